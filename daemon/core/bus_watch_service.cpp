#include "daemon/core/bus_watch_service.hpp"

#include <fmt/format.h>

#include <utility>

#include "buses/signal.hpp"
#include "daemon/core/bus_access_service.hpp"

namespace axisd::core {
namespace {

std::unexpected<Error> nothing_kept() {
  return fail(Reason::not_supported, "no flight records are kept here", "set state_directory");
}

void add_known(const MachineCore& machine, BusStatistics& to) {
  for (const auto& axis : machine.axes())
    if (axis->settings().bus == to.bus)
      to.known[axis->settings().node] = {.name = axis->settings().name,
                                         .unknown_starts = axis->unknown_starts()};
  for (const auto& device : machine.devices())
    if (device->settings().bus == to.bus)
      to.known[device->settings().node] = {.name = device->settings().name};
}

std::map<std::uint8_t, NetworkNodeStatistics> nodes_of(const canopen::Master& master) {
  std::map<std::uint8_t, NetworkNodeStatistics> nodes;
  for (const auto node : master.nodes())
    nodes[node] = {.sdo = master.sdo().counters(node),
                   .traffic = master.traffic(node),
                   .emergencies = master.emergencies().total(node)};
  return nodes;
}

void set_load(const BusLoad& load, TimePoint now, BusStatistics& to) {
  to.since_start = now - load.since();
  to.recent_load = load.recent(now);
  to.overall_load = load.overall(now);
}

}  // namespace

BusWatchService::BusWatchService(Executor executor, Clock& clock, MachineCore& machine)
    : executor_(std::move(executor)), clock_(&clock), machine_(&machine) {}

BusStatistics BusWatchService::statistics_of(const Bus& bus) const {
  BusStatistics statistics{.bus = bus.name()};
  const auto now = clock_->now();
  if (const auto* line = machine_->find_line(bus.name())) {
    statistics.line = line->statistics();
    set_load(statistics.line->load(), now, statistics);
  } else if (const auto* network = machine_->find_network(bus.name())) {
    statistics.kind = BusKind::canopen;
    statistics.network = nodes_of(network->master());
    set_load(machine_->find_recorder(bus.name())->network_load(), now, statistics);
  }
  add_known(*machine_, statistics);
  return statistics;
}

void BusWatchService::statistics(std::string bus,
                                 std::function<void(Result<std::vector<BusStatistics>>)> callback) {
  post(executor_, [this, bus = std::move(bus), callback = std::move(callback)] {
    std::vector<BusStatistics> all;
    for (const auto* known : machine_->buses())
      if (bus.empty() || known->name() == bus) all.push_back(statistics_of(*known));
    if (all.empty() && !bus.empty()) return callback(fail(no_such_bus(*machine_, bus)));
    callback(std::move(all));
  });
}

std::shared_ptr<TraceToken> BusWatchService::trace(TraceRequest request,
                                                   std::function<void(Result<TraceBatch>)> callback) {
  auto token = std::make_shared<TraceToken>();
  post(executor_, [this, request = std::move(request), alive = std::weak_ptr(token),
                   callback = std::move(callback)]() mutable {
    if (machine_->find_recorder(request.bus) == nullptr)
      return callback(fail(no_such_bus(*machine_, request.bus)));
    machine_->launch(run_trace(std::move(request), std::move(alive), std::move(callback)), "trace");
  });
  return token;
}

Task<> BusWatchService::run_trace(TraceRequest request, std::weak_ptr<TraceToken> alive,
                                  std::function<void(Result<TraceBatch>)> callback) {
  const auto& frames = machine_->find_recorder(request.bus)->frames();
  auto place = frames.end();
  if (alive.lock()) callback(TraceBatch{});
  while (!machine_->closing()) {
    co_await sleep_until(executor_, *clock_, clock_->now() + trace_period);
    const auto token = alive.lock();
    if (!token) co_return;
    if (!token->wanted.load(std::memory_order_acquire)) continue;
    auto batch = batch_of(frames, place, request);
    if (batch.frames.empty() && batch.lost == 0) continue;
    token->wanted.store(false, std::memory_order_release);
    callback(std::move(batch));
  }
}

TraceBatch BusWatchService::batch_of(const FrameRing& frames, FrameRing::Place& place,
                                     const TraceRequest& request) const {
  TraceBatch batch;
  FrameRing::Read read;
  while (batch.frames.size() < most_frames && frames.read(place, read)) {
    batch.lost += read.lost;
    if (request.node && read.frame.node != *request.node) continue;
    auto& kept =
        batch.frames.emplace_back(KeptFrame{.sequence = read.sequence,
                                            .wall = clock_->wall(read.frame.at),
                                            .frame = read.frame,
                                            .data = {read.frame.bytes.begin(), read.frame.bytes.end()}});
    kept.frame.bytes = {};
  }
  return batch;
}

void BusWatchService::flight_records(std::function<void(Result<std::vector<FlightRecord>>)> callback) {
  post(executor_, [this, callback = std::move(callback)] {
    auto* files = machine_->flight_recorder().files();
    files != nullptr ? files->list(callback) : callback(nothing_kept());
  });
}

void BusWatchService::flight_record(std::string name, std::function<void(Result<std::string>)> callback) {
  post(executor_, [this, name = std::move(name), callback = std::move(callback)] {
    auto* files = machine_->flight_recorder().files();
    files != nullptr ? files->read(name, callback) : callback(nothing_kept());
  });
}

void BusWatchService::write_flight_record(std::string bus, std::string client,
                                          std::function<void(Result<std::string>)> callback) {
  post(executor_, [this, bus = std::move(bus), client = std::move(client),
                   callback = std::move(callback)]() mutable {
    const auto* recorder = machine_->find_recorder(bus);
    if (recorder == nullptr) return callback(fail(no_such_bus(*machine_, bus)));
    machine_->flight_recorder().write(*recorder, fmt::format("asked for by {}", client), std::move(callback));
  });
}

}  // namespace axisd::core
