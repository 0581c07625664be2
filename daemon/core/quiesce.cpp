#include "daemon/core/quiesce.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "buses/canopen/canopen_bus.hpp"
#include "buses/modbus_rtu/rtu_bus.hpp"
#include "buses/signal.hpp"
#include "devices/axis/motion_machine.hpp"
#include "devices/axis/planner.hpp"
#include "devices/descriptor.hpp"

namespace axisd::core {

namespace {

constexpr auto retry = milliseconds(30);

struct Times {
  TimePoint harder;  ///< from here on quick stops
  TimePoint end;
};

/// Within homing the motor rests between its phases: there it must have rested at one place for a while.
class Rest {
 public:
  explicit Rest(std::int64_t window) : window_(window) {}
  bool confirms(const DriveSample& sample) {
    if (sample.moving) {
      since_.reset();
      return false;
    }
    if (sample.mode != DriveMode::homing) return true;
    // A measured position wavers.
    if (!since_ || std::llabs(std::int64_t{position_} - sample.position_pulses) > window_) {
      since_ = sample.asked_at;
      position_ = sample.position_pulses;
    }
    return sample.asked_at - *since_ >= milliseconds(150);
  }

 private:
  std::int64_t window_;  ///< Drive::position_window()
  std::optional<TimePoint> since_;
  std::int32_t position_ = 0;
};

Task<QuiesceReport> stop_one(Executor executor, Clock& clock, std::string axis, Drive& drive, Bus& bus,
                             Times times) {
  QuiesceReport report{.axis = std::move(axis)};
  Rest rest(drive.position_window());
  report.detail = "the port did not open";
  std::optional<TimePoint> first;  // stop that was acknowledged
  TimePoint acked{};               // the last one was
  bool rests = false;              // by the last reading, since a stop was acknowledged
  while (clock.now() < times.end) {
    if (!bus.port().open) {
      if (bus.port().error) report.detail = to_string(*bus.port().error);
      co_await bus.port_changed().wait_until(std::min(times.end, clock.now() + retry));
      continue;
    }
    if (!rests) {
      const auto kind = clock.now() < times.harder ? StopKind::stop : StopKind::quick_stop;
      const auto sent = co_await drive.stop(kind);
      acked = clock.now();
      if (!sent) {
        report.detail = to_string(sent.error());
        co_await sleep_until(executor, clock, std::min(times.end, acked + retry));
        continue;
      }
      first = first.value_or(acked);
    }
    const auto state = co_await drive.read_state(TransactionClass::moving_state);
    // What the daemon started right before it ended may begin yet, whatever was acknowledged (M13).
    const bool may_begin = state && state->asked_at < *first + start_window;
    if (state && state->asked_at >= acked && rest.confirms(*state) && !may_begin) {
      report.confirmed = true;
      report.detail = "standstill confirmed";
      co_return report;
    }
    // It is stopped again only if it moves, or does not say.
    rests = state && !state->moving;
    report.detail = !state          ? to_string(state.error())
                    : state->moving ? "still moving"
                                    : "not at rest for long enough";
    co_await sleep_until(executor, clock, std::min(times.end, clock.now() + retry));
  }
  co_return report;
}

/// With a drive that is asked first, so that its answer saves the wait for an echo before the first stop: one
/// that takes no longer to answer than the line says.
modbus_rtu::LineSettings with_witness(modbus_rtu::LineSettings line,
                                      const config::Configuration& configuration) {
  const auto on_it = [&](const auto& entry) {
    return entry.axis.bus == line.name && !entry.axis.turnaround_max;
  };
  const auto found = std::ranges::find_if(configuration.axes, on_it);
  if (found != configuration.axes.end()) line.echo_witness = found->axis.node;
  return line;
}

/// The buses of the configuration, and a drive for each axis.
class Machine {
 public:
  Machine(const QuiesceParts& parts, const config::Configuration& configuration)
      : executor_(parts.executor), ended_(parts.executor, *parts.clock) {
    for (const auto& line : configuration.lines)
      lines_.push_back(std::make_unique<modbus_rtu::RtuBus>(
          executor_, *parts.clock, line, parts.make_line(with_witness(line, configuration))));
    for (const auto& network : configuration.networks) {
      networks_.push_back(
          std::make_unique<canopen::CanopenBus>(executor_, *parts.clock, network, parts.make_port(network)));
      cyclers_.push_back(
          std::make_unique<LinkCycler>(executor_, *parts.clock, *networks_.back(), parts.link_helper));
    }
    for (const auto& entry : configuration.axes) {
      const auto* line = find(lines_, entry.axis.bus);
      const auto* network = find(networks_, entry.axis.bus);
      drives_.push_back(descriptor_of(entry.axis)
                            ->make({.executor = executor_,
                                    .clock = parts.clock,
                                    .rtu = line == nullptr ? nullptr : line->get(),
                                    .canopen = network == nullptr ? nullptr : network->get(),
                                    .node = entry.axis.node,
                                    .setup = {.own_descriptor = entry.axis.own_descriptor}}));
      if (line != nullptr && entry.axis.turnaround_max)
        line->get()->set_turnaround_max(entry.axis.node, *entry.axis.turnaround_max);
      buses_.push_back(line != nullptr ? static_cast<Bus*>(line->get()) : network->get());
    }
    // After the drives, which are attached to their network before it starts.
    for (const auto& line : lines_) line->start();
    for (const auto& network : networks_) network->start();
    for (const auto& cycler : cyclers_) spawn(executor_, counted(cycler->run(), cycling_), "link cycler");
  }

  [[nodiscard]] Drive& drive(std::size_t axis) const { return *drives_[axis]; }
  [[nodiscard]] Bus& bus(std::size_t axis) const { return *buses_[axis]; }

  /// Runs a sequence that uses what this owns.
  void launch(Task<> sequence, std::string name) {
    spawn(executor_, counted(std::move(sequence), stopping_), std::move(name));
  }
  /// Waits for what was launched, then ends the rest.
  Task<> finish() {
    while (stopping_ > 0) co_await ended_.wait();
    for (const auto& cycler : cyclers_) cycler->close();
    for (const auto& network : networks_) network->close();
    while (cycling_ > 0) co_await ended_.wait();
  }

 private:
  template <class T>
  static const std::unique_ptr<T>* find(const std::vector<std::unique_ptr<T>>& buses,
                                        const std::string& name) {
    const auto found = std::ranges::find_if(buses, [&](const auto& bus) { return bus->name() == name; });
    return found == buses.end() ? nullptr : &*found;
  }
  Task<> counted(Task<> sequence, int& running) {
    ++running;
    auto run = [](Task<> inner, int& count, Signal& ended) -> Task<> {
      co_await std::move(inner);
      --count;
      ended.notify_all();
    };
    return run(std::move(sequence), running, ended_);
  }

  Executor executor_;
  Signal ended_;
  std::vector<std::unique_ptr<modbus_rtu::RtuBus>> lines_;
  std::vector<std::unique_ptr<canopen::CanopenBus>> networks_;
  std::vector<std::unique_ptr<LinkCycler>> cyclers_;
  std::vector<std::unique_ptr<Drive>> drives_;  ///< one per axis
  std::vector<Bus*> buses_;                     ///< likewise
  int stopping_ = 0, cycling_ = 0;              ///< sequences that run
};

}  // namespace

Task<std::vector<QuiesceReport>> quiesce(QuiesceParts parts, const config::Configuration& configuration,
                                         Duration limit) {
  const auto now = parts.clock->now();
  const Times times{.harder = now + limit / 2, .end = now + limit};
  Machine machine(parts, configuration);
  std::vector<QuiesceReport> reports(configuration.axes.size());
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const auto& name = configuration.axes[i].axis.name;
    auto one = [](Task<QuiesceReport> stopping, QuiesceReport& report) -> Task<> {
      report = co_await std::move(stopping);
    };
    machine.launch(one(stop_one(parts.executor, *parts.clock, name, machine.drive(i), machine.bus(i), times),
                       reports[i]),
                   "quiesce " + name);
  }
  co_await machine.finish();
  co_return reports;
}

}  // namespace axisd::core
