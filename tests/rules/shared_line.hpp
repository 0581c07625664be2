// Many axes on one RS-485 line.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "config/budget.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/virtual_line.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

/// `count` axes on one line, endless, 1000 pulses/rev.
class SharedLine {
 public:
  SharedLine(int count, int baud, const std::function<void(AxisSettings&)>& adjust = {}) {
    configuration_.machine = "line";
    configuration_.lines.push_back({.name = "line-a", .port = "sim", .baud = baud});
    for (int i = 1; i <= count; ++i) {
      AxisSettings axis{.name = "a" + std::to_string(i),
                        .bus = "line-a",
                        .node = static_cast<std::uint8_t>(i),
                        .model = "ykd2405pr"};
      axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .unit = "mm"};
      axis.limits.velocity = 100;
      if (adjust) adjust(axis);
      configuration_.axes.push_back({.axis = axis});
    }
    machine_ = std::make_unique<core::MachineCore>(
        core::MachineParts{.executor = world.executor(),
                           .clock = &world.clock(),
                           .instance_id = "t",
                           .make_line =
                               [this](const modbus_rtu::LineSettings& settings) {
                                 auto made = std::make_unique<VirtualLine>(world, settings);
                                 line = made.get();
                                 return made;
                               },
                           .budgets = config::budgets(configuration_)},
        configuration_);
    for (int i = 1; i <= count; ++i)
      line->network().add(
          simulation::find_simulator("ykd2405pr")->make({.address = static_cast<std::uint8_t>(i)}));
    line->network().advance(world.now());
    machine_->start();
  }
  ~SharedLine() {
    machine_->close();
    EXPECT_TRUE(world.run_until([this] { return machine_->closed(); }, std::chrono::seconds(60)));
  }
  [[nodiscard]] bool all(const std::function<bool(const AxisSnapshot&)>& condition) const {
    for (const auto& axis : machine_->axes())
      if (!condition(*axis->snapshot())) return false;
    return true;
  }
  core::MachineCore& machine() { return *machine_; }
  CommandPtr submit(int axis, const Action& action) {
    auto command = machine_->submit("a" + std::to_string(axis), action, {.arrived = world.now()});
    EXPECT_TRUE(command) << (command ? "" : to_string(command.error()));
    return command.value_or(nullptr);
  }

  VirtualWorld world;
  VirtualLine* line = nullptr;

 private:
  config::Configuration configuration_;
  std::unique_ptr<core::MachineCore> machine_;
};

}  // namespace axisd::test
