#include "daemon/core/bus_watch_service.hpp"

#include <fmt/format.h>

#include <algorithm>
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

std::map<std::uint8_t, QuarantineStatus> quarantine_of(const modbus_rtu::RtuBus& line, TimePoint now) {
  std::map<std::uint8_t, QuarantineStatus> nodes;
  for (const auto& [address, node] : line.quarantine().nodes()) {
    if (node.entered == 0) continue;
    auto& status = nodes[address];
    status.times = node.entered;
    status.active = node.quarantined();
    if (!status.active) continue;
    status.lasting = now - node.since;
    status.next_probe_in = std::max(node.next - now, Duration{});
    status.probes = node.probes;
  }
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
    statistics.quarantine = quarantine_of(*line, now);
    statistics.held_back = line->held_back();
    set_load(statistics.line->load(), now, statistics);
  } else if (const auto* network = machine_->find_network(bus.name())) {
    statistics.kind = BusKind::canopen;
    statistics.network = nodes_of(network->master());
    statistics.sdo = network->master().sdo().classes();
    set_load(machine_->find_recorder(bus.name())->network_load(), now, statistics);
  }
  add_known(*machine_, statistics);
  return statistics;
}

Result<std::vector<BusStatistics>> BusWatchService::statistics_of(const std::string& bus) const {
  std::vector<BusStatistics> all;
  for (const auto* known : machine_->buses())
    if (bus.empty() || known->name() == bus) all.push_back(statistics_of(*known));
  if (all.empty() && !bus.empty()) return fail(no_such_bus(*machine_, bus));
  return all;
}

void BusWatchService::statistics(std::string bus,
                                 std::function<void(Result<std::vector<BusStatistics>>)> callback) {
  post(executor_,
       [this, bus = std::move(bus), callback = std::move(callback)] { callback(statistics_of(bus)); });
}

std::shared_ptr<StreamToken> BusWatchService::watch_statistics(
    std::string bus, Duration period, std::function<void(Result<StatisticsTick>)> callback) {
  auto token = std::make_shared<StreamToken>();
  post(executor_, [this, bus = std::move(bus), period, alive = std::weak_ptr(token),
                   callback = std::move(callback)]() mutable {
    machine_->launch(run_statistics(std::move(bus), period, std::move(alive), std::move(callback)),
                     "statistics");
  });
  return token;
}

Task<> BusWatchService::run_statistics(std::string bus, Duration period, std::weak_ptr<StreamToken> alive,
                                       std::function<void(Result<StatisticsTick>)> callback) {
  std::uint64_t missed = 0;
  bool owed = false;
  auto due = clock_->now();
  while (!machine_->closing()) {
    const auto now = clock_->now();
    if (now >= due) {
      if (std::exchange(owed, true)) ++missed;
      due += ((now - due) / period + 1) * period;
    }
    {
      const auto token = alive.lock();
      if (!token) co_return;
      if (owed && token->wanted.exchange(false, std::memory_order_acq_rel)) {
        owed = false;
        auto buses = statistics_of(bus);
        if (!buses) co_return callback(fail(buses.error()));
        callback(StatisticsTick{.buses = *std::move(buses), .missed = std::exchange(missed, 0)});
      }
    }
    // However long the period: an end is noticed soon, and a tick that is owed given.
    co_await sleep_until(executor_, *clock_, std::min(due, now + shortest_statistics_period));
  }
}

std::shared_ptr<StreamToken> BusWatchService::trace(TraceRequest request,
                                                    std::function<void(Result<TraceBatch>)> callback) {
  auto token = std::make_shared<StreamToken>();
  post(executor_, [this, request = std::move(request), alive = std::weak_ptr(token),
                   callback = std::move(callback)]() mutable {
    if (machine_->find_recorder(request.bus) == nullptr)
      return callback(fail(no_such_bus(*machine_, request.bus)));
    machine_->launch(run_trace(std::move(request), std::move(alive), std::move(callback)), "trace");
  });
  return token;
}

Task<> BusWatchService::run_trace(TraceRequest request, std::weak_ptr<StreamToken> alive,
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
