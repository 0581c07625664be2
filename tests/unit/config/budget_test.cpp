// What the budget of a configuration adds to that of its buses.
#include "config/budget.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

TEST(Budget, AStopWithoutBoundHasAWayWithoutBound) {
  const auto furthest_way = [](int axes) {
    std::string text =
        "machine: m\nbuses:\n  can0: { canopen: { interface: sim, bitrate: 125000, sync_period: 10 ms } "
        "}\naxes:\n";
    for (int node = 1; node <= axes; ++node)
      text += fmt::format(
          "  axis{0}: {{ bus: can0, node: {0}, model: yss-c, unit: rev, scale: {{ microstep: 4000 pulses/rev "
          "}},\n"
          "    limits: {{ velocity: 1 rev/s }} }}\n",
          node);
    const auto result = load_text(text, "m.yaml");
    EXPECT_TRUE(result.configuration) << findings(result);
    return budgets(result.configuration.value()).at(0).axes.at(0).way_all;
  };
  EXPECT_TRUE(std::isfinite(furthest_way(1)));
  EXPECT_TRUE(std::isinf(furthest_way(32)));
}

/// The line's bounds are those of `axisctl budget`; before them comes what the service takes.
TEST(Budget, SaysWhenTheLastStopGoesOutWhereTheDaemonHangs) {
  const auto result = load_text(
      "machine: m\nbuses:\n  line-a: { modbus_rtu: { port: sim, baud: 115200, turnaround_max: 200 ms } }\n"
      "  empty: { modbus_rtu: { port: sim } }\naxes:\n"
      "  feeder: { bus: line-a, node: 1, model: ykd2405pr, unit: rev,\n"
      "            scale: { microstep: 10000 pulses/rev }, limits: { velocity: 1 rev/s } }\n",
      "m.yaml");
  ASSERT_TRUE(result.configuration) << findings(result);
  const auto reports = budgets(result.configuration.value());
  const auto told = [](const BusBudgetReport& report, const std::string& text) {
    return std::ranges::count_if(report.predicted.notes,
                                 [&](const auto& note) { return note.find(text) != std::string::npos; });
  };
  const auto learnt = std::chrono::milliseconds(200);
  const auto all =
      killed_within + quiesce_begins_within + learnt + reports.at(0).predicted.stops.back().last_frame;
  EXPECT_EQ(told(reports.at(0), "hangs"), 1);
  EXPECT_EQ(told(reports.at(0), within_text(all)), 1) << within_text(all);
  EXPECT_EQ(told(reports.at(1), "hangs"), 0) << "it has no axes";
}

}  // namespace
}  // namespace axisd::config
