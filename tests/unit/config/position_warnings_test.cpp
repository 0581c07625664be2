#include "config/position_warnings.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "config/budget.hpp"
#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

using ::testing::HasSubstr;

std::vector<std::string> warnings_of(std::string_view bus, std::string_view model, std::string_view keys) {
  const auto result = load_text(fmt::format(R"(machine: m
buses: {{ line: {{ {}: {{ {}: sim }} }} }}
axes:
  feeder:
    {{ bus: line, node: 1, model: {}, unit: rev, scale: {{ microstep: 1000 pulses/rev }},
      limits: {{ velocity: 1 rev/s }}, {} }}
)",
                                            bus, bus == "canopen" ? "interface" : "port", model, keys),
                                "m.yaml");
  EXPECT_TRUE(result.configuration) << findings(result);
  return result.configuration ? position_warnings(*result.configuration) : std::vector<std::string>();
}

TEST(PositionWarnings, AReleaseByATerminalMayBeMissed) {
  for (const auto* keys : {"drive: { loop_mode: open, released_position: counted }", "load: normal"})
    for (const auto* model : {"ssd2608pr", "ess42-r"})
      EXPECT_THAT(
          warnings_of("modbus_rtu", model,
                      fmt::format("inputs: {{ X3: motor_free }}, poll: {{ idle: 150 ms }}, {}", keys)),
          ::testing::ElementsAre(HasSubstr("axis feeder: a release by X3 (motor_free) that is shorter "
                                           "than its polling at rest (150 ms)")));
  EXPECT_EQ(warnings_of("modbus_rtu", "ykd2405pr", "inputs: { X3: motor_free }").size(), 1U);
}

TEST(PositionWarnings, WhatIsCountedOrSeenIsNotWarnedOf) {
  EXPECT_TRUE(warnings_of("modbus_rtu", "ess42-r",
                          "inputs: { X3: motor_free }, drive: { released_position: counted }")
                  .empty());
  EXPECT_TRUE(warnings_of("modbus_rtu", "ykd2405pr", "inputs: { X3: stop }").empty());
  EXPECT_TRUE(warnings_of("canopen", "yss-c", "inputs: { X3: motor_free }").empty());
}

TEST(PositionWarnings, AreAmongAllWarnings) {
  const auto result = load_text(R"(machine: m
buses: { line: { modbus_rtu: { port: sim } } }
axes:
  feeder:
    { bus: line, node: 1, model: ykd2405pr, unit: rev, scale: { microstep: 1000 pulses/rev },
      limits: { velocity: 1 rev/s }, inputs: { X3: motor_free } }
)",
                                "m.yaml");
  ASSERT_TRUE(result.configuration) << findings(result);
  EXPECT_THAT(warnings(*result.configuration), ::testing::Contains(HasSubstr("motor_free")));
}

}  // namespace
}  // namespace axisd::config
