#include "daemon/core/machine_core.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "buses/limited_log.hpp"
#include "buses/log_about.hpp"
#include "devices/nearest.hpp"

namespace axisd::core {

namespace {

NetworkStatus network_status(const canopen::CanopenBus& bus, const LinkCycler& cycler) {
  const auto& master = bus.master();
  NetworkStatus status{.link = bus.link().link,
                       .frames = master.port().counters(),
                       .sdo = master.sdo().counters(),
                       .sync_period = bus.settings().sync_period,
                       .sync_running = bus.sync_running(),
                       .sync = master.sync().counters(),
                       .others = master.counters(),
                       .foreign_nodes = {master.foreign_nodes().begin(), master.foreign_nodes().end()},
                       .link_helper_error = cycler.trouble()};
  for (std::uint8_t node = 1; node <= canopen::highest_node; ++node)
    status.emergencies += master.emergencies().total(node);
  return status;
}

/// Why the network cannot be used, or that it can again, where `told` is what was said before.
void log_link(const canopen::CanopenBus& network, std::string& told) {
  const auto& port = network.port();
  const auto now = port.open || !port.error ? std::string() : to_string(*port.error);
  if (now == told) return;
  if (now.empty())
    log_about(spdlog::level::info, LogKind::bus_up, {.bus = network.name()},
              fmt::format("{}: CAN interface {} is up", network.name(), network.settings().interface));
  else
    log_about(spdlog::level::warn, LogKind::bus_down, {.bus = network.name()}, now);
  told = now;
}

}  // namespace

MachineCore::MachineCore(MachineParts parts, const config::Configuration& configuration)
    : parts_(std::move(parts)),
      book_(*parts_.clock, parts_.instance_id, parts_.journal,
            {.total = static_cast<std::size_t>(configuration.server.limits.request_ids)}),
      audit_(*parts_.clock, parts_.audit),
      commands_([this](const std::string& axis, EventContent content) {
        events_.record(parts_.clock->wall(parts_.clock->now()), axis, std::move(content));
      }),
      flight_recorder_(*parts_.clock, parts_.flight_records,
                       [this](const std::string& axis, const FlightRecordWritten& record) {
                         events_.record(parts_.clock->wall(parts_.clock->now()), axis, record);
                       }),
      leases_(
          *parts_.clock, configuration.leases,
          parts_.persistence == nullptr ? 0 : parts_.persistence->loaded().start_count,
          [this](std::string_view axis) { return find(axis); },
          [this](const std::string& axis, EventContent content) { on_event(axis, std::move(content)); }),
      holds_(
          *parts_.clock, parts_.persistence,
          [this](const std::string& axis, EventContent content) { on_event(axis, std::move(content)); },
          [this](std::string_view axis) {
            if (auto* found = find(axis)) found->refresh();
          }),
      state_gate_(
          parts_.persistence,
          [this](KeptStateChange change) {
            events_.record(parts_.clock->wall(parts_.clock->now()), {}, std::move(change));
          },
          [this] {
            for (const auto& axis : axes_) axis->refresh();
          }),
      inhibit_(*parts_.clock, parts_.persistence,
               [this](InhibitChange change) { tell_inhibit(std::move(change)); }),
      groups_({.executor = parts_.executor,
               .clock = parts_.clock,
               .book = &book_,
               .instance_id = parts_.instance_id,
               .find = [this](std::string_view axis) { return find(axis); },
               .axes = [this] { return table()->axes; },
               .launch = [this](Task<> task, const char* name) { launch(std::move(task), name); }},
              configuration.groups) {
  events_.keep([this](const Event& event) { audit_.event(event); });
  book_.on_open([this](const CommandPtr& command) { commands_.add(command); });
  const auto memory = static_cast<std::size_t>(configuration.flight_recorder.memory) * 1024;
  for (const auto& line : configuration.lines) add_line(line, memory);
  for (const auto& network : configuration.networks) add_network(network, memory);
  for (const auto& entry : configuration.axes) {
    axes_.push_back(make_axis(entry.axis, nullptr));
    by_name_.emplace(entry.axis.name, axes_.back().get());
  }
  for (const auto& settings : configuration.devices) devices_.push_back(make_device(settings));
  publish_table();
}

MachineCore::~MachineCore() = default;

/// A stop of some axes is promised no later than one of all.
void MachineCore::expect_stops() {
  for (const auto& report : parts_.budgets)
    for (const auto& axis : report.axes)
      if (auto* found = find(axis.predicted.axis)) found->expect_stop_within(axis.predicted.all.last_frame);
}

void MachineCore::launch(Task<> sequence, const char* name) {
  ++sequences_;
  auto counted = [](Task<> inner, int& count) -> Task<> {
    co_await std::move(inner);
    --count;
  };
  spawn(parts_.executor, counted(std::move(sequence), sequences_), name);
}

void MachineCore::tell_inhibit(InhibitChange change) {
  events_.record(parts_.clock->wall(parts_.clock->now()), {}, std::move(change));
}

void MachineCore::start() {
  state_gate_.start();
  inhibit_.start();
  for (const auto& command : book_.take_interrupted()) commands_.follow(command);
  expect_stops();
  for (std::size_t i = 0; i < buses_.lines.size(); ++i)
    buses_.lines[i]->start(recorders_[i]->exchange_observer());
  for (const auto& network : buses_.networks) network->start();
  for (const auto& cycler : buses_.cyclers) launch(cycler->run(), "link cycler");
  for (const auto& network : buses_.networks) launch(watch(*network), "network watch");
  for (auto* bus : buses_.all) launch(watch_port(*bus), "port watch");
  for (const auto& axis : axes_) axis->start();
  book_.give_up_unsettled();
  for (const auto& device : devices_) device->start();
}

/// A link that was cycled may be up again before any axis polls, and each drive may have gone on meanwhile.
Task<> MachineCore::watch(canopen::CanopenBus& network) {
  auto seen = network.losses();
  std::string told;
  while (!closing()) {
    log_link(network, told);
    co_await network.port_changed().wait();
    if (closing() || std::exchange(seen, network.losses()) == network.losses()) continue;
    for (const auto& axis : axes_)
      if (axis->settings().bus == network.name())
        axis->bus_lost(
            network.last_loss().value_or(Error{.reason = Reason::bus_down, .message = "the bus was lost"}));
  }
}

/// A port that was lost leaves what went before it in a flight record.
Task<> MachineCore::watch_port(Bus& bus) {
  while (!closing()) {
    const bool was_open = bus.port().open;
    co_await bus.port_changed().wait();
    if (closing() || !was_open || bus.port().open) continue;
    flight_recorder_.fault(*find_recorder(bus.name()), {},
                           bus.port().error ? to_string(*bus.port().error) : "the bus was lost");
  }
}

const BusRecorder* MachineCore::find_recorder(std::string_view bus) const {
  const auto found = std::ranges::find_if(recorders_, [&](const auto& r) { return r->bus() == bus; });
  return found == recorders_.end() ? nullptr : found->get();
}

void MachineCore::on_event(const std::string& axis, EventContent content) {
  if (const auto* found = find(axis)) note_fault(*found, content);
  events_.record(parts_.clock->wall(parts_.clock->now()), axis, std::move(content));
}

/// What a person will ask about afterwards: an axis that stopped by an error (an alarm, a stop that was not
/// confirmed, an outcome that is unknown), or whose drive fell silent while it moved.
void MachineCore::note_fault(const Axis& axis, const EventContent& content) {
  const auto now = axis.snapshot();
  const auto& recorder = *find_recorder(axis.settings().bus);
  const auto& name = axis.settings().name;
  const auto because = [&](std::string_view what, const std::optional<Error>& error) {
    std::string_view message = error ? error->message : std::string_view();
    if (message.starts_with(name + ": ")) message.remove_prefix(name.size() + 2);
    flight_recorder_.fault(recorder, name,
                           fmt::format("{}: {}{}{}", name, what, message.empty() ? "" : ": ", message));
  };
  if (const auto* state = std::get_if<StateChange>(&content);
      state != nullptr && state->to == AxisState::error_stop)
    because("ErrorStop", now->fault);
  if (const auto* link = std::get_if<LinkChange>(&content);
      link != nullptr && link->to == LinkState::offline && now->moving)
    because("silent while it moved", now->link_error);
}

Axis* MachineCore::find(std::string_view axis) const {
  const auto found = by_name_.find(axis);
  return found == by_name_.end() ? nullptr : found->second;
}

Result<CommandPtr> MachineCore::submit(const std::string& axis, const Action& action,
                                       const CommandOptions& options) {
  auto* found = find(axis);
  if (found == nullptr) return no_axis(axis, action, options);
  const auto* stop = std::get_if<StopRequest>(&action);
  if (stop != nullptr && stop->hold) return submit_held(axis, *stop, options, {});
  return execute(*found, action, options);
}

Result<CommandPtr> MachineCore::execute(Axis& axis, const Action& action, const CommandOptions& options) {
  const auto* stop = std::get_if<StopRequest>(&action);
  if (const auto leaving = exchange_.leaving.find(axis.settings().name);
      leaving != exchange_.leaving.end() && stop != nullptr)
    return hold_stop(leaving->second, axis.settings().name, *stop, options);
  auto command = axis.submit(action, options);
  if (!command) audit_.refused(axis.settings().name, action, options, command.error());
  return command;
}

Result<CommandPtr> MachineCore::no_axis(const std::string& axis, const Action& action,
                                        const CommandOptions& options) {
  auto error = no_such_axis(axis, table()->axes);
  audit_.refused(axis, action, options, error);
  return fail(std::move(error));
}

/// The hold first, so that the axis never shows, nor accepts, anything between the stop and it.
Result<CommandPtr> MachineCore::submit_held(const std::string& axis, const StopRequest& request,
                                            const CommandOptions& options, std::function<void()> settled) {
  auto* found = find(axis);
  if (found == nullptr) return no_axis(axis, request, options);
  holds_.add(axis, {.holder = options.client, .request_id = options.request_id}, options.arrived,
             std::move(settled));
  return execute(*found, request, options);
}

void MachineCore::release_stop(const std::string& axis, const HoldRelease& release,
                               std::function<void(Result<StopReleased>)> done) {
  const auto* found = find(axis);
  if (found == nullptr) return done(fail(no_such_axis(axis, table()->axes)));
  const bool everybody = release.whose == HoldRelease::Whose::everybody;
  if (everybody) {
    const auto may = found->check_lease({.client = release.client, .lease_token = release.lease_token});
    if (!may) return done(fail(may.error()));
  }
  holds_.release(axis, release, [this, axis, done = std::move(done)](const Result<void>& released) {
    if (!released) return done(fail(released.error()));
    StopReleased answer{.holds = holds_.of(axis)->all()};
    if (const auto* now = find(axis); now != nullptr && now->last_stop())
      answer.stop = now->last_stop()->value();
    done(std::move(answer));
  });
}

std::vector<Result<CommandPtr>> MachineCore::stop_all(const std::string& client, TimePoint arrived,
                                                      std::function<void(std::optional<Error>)> latched,
                                                      const CallOriginPtr& origin) {
  inhibit_.latch(client, std::move(latched));
  // The line serves stops in the order in which they are queued.
  const auto rank = [](const Axis& axis) {
    if (axis.snapshot()->link == LinkState::offline) return 2;
    return axis.at_rest() ? 1 : 0;
  };
  std::vector<std::pair<int, std::size_t>> order;
  order.reserve(axes_.size());
  for (std::size_t i = 0; i < axes_.size(); ++i) order.emplace_back(rank(*axes_[i]), i);
  std::ranges::sort(order);
  std::vector<Result<CommandPtr>> results(axes_.size(), fail(Reason::internal, "not stopped"));
  for (const auto& [urgency, i] : order)
    results[i] = submit(axes_[i]->settings().name, StopRequest{.kind = StopKind::stop, .all = true},
                        {.client = client, .arrived = arrived, .origin = origin});
  // After the stops: nobody's look at the events or the log may hold them up.
  tell_inhibit({.what = InhibitChange::What::latched, .by = client});
  log_limited(spdlog::level::warn, "StopAll by " + client, "stops",
              "motion is inhibited until it is released", LogKind::stop_all, {.client = client});
  return results;
}

void MachineCore::release_inhibit(const std::string& client, std::function<void(Result<void>)> done) {
  inhibit_.release(client, [this, client, done = std::move(done)](Result<void> released) {
    if (released) {
      tell_inhibit({.what = InhibitChange::What::released, .by = client});
      log_limited(spdlog::level::warn, client, "releases", "StopAll is released", LogKind::stop_all_released,
                  {.client = client});
      for (const auto& axis : axes_) axis->refresh();
    }
    done(std::move(released));
  });
}

std::vector<std::string> MachineCore::stop_moving_axes() {
  life_ = std::max(life_, Life::ending);
  std::vector<std::string> stopped;
  for (const auto& axis : axes_) {
    if (axis->at_rest()) continue;
    (void)submit(axis->settings().name, StopRequest{.kind = StopKind::stop}, {.client = "shutdown"});
    stopped.push_back(axis->settings().name);
  }
  return stopped;
}

bool MachineCore::at_rest() const {
  return exchange_.state != Exchange::State::under_way && !exchange_.unconfirmed &&
         std::ranges::all_of(axes_, [](const auto& axis) { return axis->at_rest(); });
}

void MachineCore::close() {
  life_ = Life::closing;
  flight_recorder_.close();
  leases_.close();
  for (const auto& axis : axes_) axis->close();
  for (const auto& device : devices_) device->close();
  for (const auto& cycler : buses_.cyclers) cycler->close();
  for (auto* bus : buses_.all) bus->close();
}

bool MachineCore::closed() const {
  return sequences_ == 0 && std::ranges::all_of(axes_, [](const auto& axis) { return axis->closed(); }) &&
         std::ranges::all_of(devices_, [](const auto& device) { return device->closed(); }) &&
         std::ranges::all_of(buses_.all, [](const auto* bus) { return bus->idle(); });
}

std::vector<BusStatus> MachineCore::bus_status() const {
  std::vector<BusStatus> all;
  all.reserve(buses_.lines.size() + buses_.networks.size());
  for (const auto& bus : buses_.lines)
    all.push_back({.name = bus->settings().name,
                   .port = bus->settings().port,
                   .baud = bus->settings().baud,
                   .open = bus->port().open,
                   .simulated = bus->settings().simulated(),
                   .error = bus->port().error,
                   .counters = bus->counters()});
  for (std::size_t i = 0; i < buses_.networks.size(); ++i) {
    const auto& bus = buses_.networks[i];
    all.push_back({.name = bus->settings().name,
                   .kind = BusKind::canopen,
                   .port = bus->settings().interface,
                   .baud = static_cast<int>(bus->settings().bitrate),
                   .open = bus->port().open,
                   .simulated = bus->settings().simulated(),
                   .error = bus->port().error ? bus->port().error : bus->sync_trouble(),
                   .network = network_status(*bus, *buses_.cyclers[i])});
  }
  return all;
}

std::vector<BusBudgetReport> MachineCore::budgets() const {
  auto reports = parts_.budgets;
  for (auto& report : reports)
    for (auto& axis : report.axes)
      if (const auto* seen = find(axis.predicted.axis)) axis.observed = seen->observed();
  return reports;
}

bool MachineCore::buses_reported() const {
  return std::ranges::all_of(
      buses_.all, [](const auto* bus) { return bus->port().open || bus->port().error.has_value(); });
}

}  // namespace axisd::core
