// What the budget of a configuration adds to that of its buses.
#include "config/budget.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace axisd::config
