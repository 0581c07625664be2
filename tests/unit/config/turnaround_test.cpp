// Turnarounds of single nodes, and what of a bus's time is the host's.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "config/budget.hpp"
#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

using namespace std::chrono_literals;

TEST(Turnaround, OnlyNodesOnRs485HaveATurnaround) {
  const auto result = load_text(R"(machine: m
buses:
  line-a: { modbus_rtu: { port: sim } }
  can0: { canopen: { interface: sim } }
axes:
  feeder:
    { bus: line-a, node: 1, model: ykd2405pr, unit: rev, scale: { microstep: 1000 pulses/rev },
      limits: { velocity: 1 rev/s }, turnaround_max: 8 ms }
  arm:
    { bus: can0, node: 2, model: yss-c, unit: rev, scale: { microstep: 4000 pulses/rev },
      limits: { velocity: 1 rev/s }, turnaround_max: 8 ms }
devices:
  oven:
    { bus: line-a, node: 7, model: modbus-generic, turnaround_max: 60 ms, registers: { t: { address: 1 } } }
  valves:
    { bus: can0, node: 8, model: canopen-generic, turnaround_max: 60 ms,
      objects: { t: { object: 6401h:01, type: u8 } } }
)",
                                "m.yaml");
  const auto found = findings(result);
  EXPECT_EQ(result.diagnostics.size(), 2U) << found;
  EXPECT_NE(found.find("11:54: model yss-c is not on RS-485"), std::string::npos) << found;
  EXPECT_NE(found.find("16:67: model canopen-generic is not on RS-485"), std::string::npos) << found;
}

TEST(Turnaround, OfANodeIsPartOfTheBudget) {
  const auto last_stop = [](std::string_view bus, std::string_view axis) {
    const auto result = load_text(fmt::format(R"(machine: m
buses: {{ line-a: {{ modbus_rtu: {{ port: sim{} }} }} }}
axes:
  feeder:
    {{ bus: line-a, node: 1, model: ykd2405pr, unit: rev, scale: {{ microstep: 1000 pulses/rev }},
      limits: {{ velocity: 1 rev/s }}{} }}
)",
                                              bus, axis),
                                  "m.yaml");
    EXPECT_TRUE(result.configuration) << findings(result);
    return budgets(*result.configuration).at(0).predicted.stops.at(0).last_frame;
  };
  const auto usual = last_stop("", "");
  EXPECT_EQ(last_stop("", ", turnaround_max: 50 ms") - usual, 30ms);
  EXPECT_EQ(last_stop(", turnaround_max: 50 ms", ", turnaround_max: 20 ms"), usual);
  EXPECT_EQ(last_stop(", host_allowance: 1 ms", "") - usual, -4ms);
}

}  // namespace
}  // namespace axisd::config
