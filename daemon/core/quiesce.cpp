#include "daemon/core/quiesce.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "buses/signal.hpp"
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
  bool confirms(const DriveSample& sample) {
    if (sample.moving) {
      since_.reset();
      return false;
    }
    if (sample.mode != DriveMode::homing) return true;
    if (!since_ || position_ != sample.position_pulses) since_ = sample.asked_at;
    position_ = sample.position_pulses;
    return sample.asked_at - *since_ >= milliseconds(150);
  }

 private:
  std::optional<TimePoint> since_;
  std::int32_t position_ = 0;
};

Task<QuiesceReport> stop_one(Executor executor, Clock& clock, std::string axis, Drive& drive, Bus& bus,
                             Times times) {
  QuiesceReport report{.axis = std::move(axis)};
  Rest rest;
  report.detail = "the port did not open";
  while (clock.now() < times.end) {
    if (!bus.port().open) {
      if (bus.port().error) report.detail = to_string(*bus.port().error);
      co_await bus.port_changed().wait_until(std::min(times.end, clock.now() + retry));
      continue;
    }
    const auto kind = clock.now() < times.harder ? StopKind::stop : StopKind::quick_stop;
    const auto sent = co_await drive.stop(kind);
    const auto acked = clock.now();
    if (sent) {
      const auto state = co_await drive.read_state(TransactionClass::moving_state);
      if (state && state->asked_at >= acked && rest.confirms(*state)) {
        report.confirmed = true;
        report.detail = "standstill confirmed";
        co_return report;
      }
      report.detail = state ? "still moving" : to_string(state.error());
    } else {
      report.detail = to_string(sent.error());
    }
    co_await sleep_until(executor, clock, std::min(times.end, clock.now() + retry));
  }
  co_return report;
}

}  // namespace

Task<std::vector<QuiesceReport>> quiesce(
    Executor executor, Clock& clock, const config::Configuration& configuration,
    std::function<std::unique_ptr<modbus_rtu::Line>(const modbus_rtu::LineSettings&)> make_line,
    Duration limit) {
  std::vector<std::unique_ptr<modbus_rtu::RtuBus>> buses;
  for (const auto& line : configuration.lines) {
    buses.push_back(std::make_unique<modbus_rtu::RtuBus>(executor, clock, line, make_line(line)));
    buses.back()->start();
  }
  const Times times{.harder = clock.now() + limit / 2, .end = clock.now() + limit};
  std::vector<QuiesceReport> reports(configuration.axes.size());
  std::vector<std::unique_ptr<Drive>> drives;
  std::size_t running = configuration.axes.size();
  Signal ended(executor, clock);
  for (std::size_t i = 0; i < configuration.axes.size(); ++i) {
    const auto& settings = configuration.axes[i].axis;
    const auto bus =
        std::ranges::find_if(buses, [&](const auto& b) { return b->settings().name == settings.bus; });
    const auto* descriptor = find_drive_model(settings.model);
    drives.push_back(descriptor->make(
        {.executor = executor, .clock = &clock, .rtu = bus->get(), .node = settings.node, .setup = {}}));
    auto one = [](Task<QuiesceReport> stopping, QuiesceReport& report, std::size_t& left,
                  Signal& done) -> Task<> {
      report = co_await std::move(stopping);
      --left;
      done.notify_all();
    };
    spawn(executor,
          one(stop_one(executor, clock, settings.name, *drives.back(), **bus, times), reports[i], running,
              ended),
          "quiesce " + settings.name);
  }
  while (running > 0) co_await ended.wait();
  co_return reports;
}

}  // namespace axisd::core
