// Limit switches: a limit that blocks the wrong direction is a crash (M18).
#include <gtest/gtest.h>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

std::string run_into_limits(const Setup& setup) {
  for (const bool positive : {true, false}) {
    SCOPED_TRACE(positive ? "positive" : "negative");
    Bench bench(setup, {.limits = false});
    bench.ready();
    const double way = positive ? 1 : -1;
    const double edge = positive ? positive_limit_at : negative_limit_at;
    const auto run = bench.client.velocity(100 * way, {}, v1::WAIT_UNTIL_DONE);
    expect_end(run, v1::COMMAND_STATE_ABORTED, v1::REASON_LIMIT_SWITCH);
    bench.pass(500ms);
    EXPECT_FALSE(bench.shaft().moving);
    EXPECT_GE((bench.shaft().mm - edge) * way, -0.05) << "stopped before the switch";
    EXPECT_LE((bench.shaft().mm - edge) * way, 10) << "ran through the switch";
    const auto state = bench.state();
    // The overtravel stop has no ramp (M20).
    if (!setup.manual.says_yes("closed_loop")) EXPECT_EQ(state.trust(), v1::POSITION_TRUST_UNKNOWN);
    bench.enable();
    expect_refused(bench.client.move_by(5 * way), v1::REASON_LIMIT_SWITCH);
    expect_refused(bench.client.velocity(20 * way), v1::REASON_LIMIT_SWITCH);
    expect_refused(bench.client.jog(20 * way), v1::REASON_LIMIT_SWITCH);
    const auto there = bench.shaft().mm;
    expect_done(bench.client.move_by(-30 * way));
    EXPECT_NEAR(bench.shaft().mm, there - (30 * way), 0.01 + close_to_target(setup))
        << "moving away has to be possible";
    bench.finish(2);
  }
  return "yes";
}

/// A switch that becomes active at standstill blocks its own axis direction, and no other.
std::string limits_at_standstill(const Setup& setup) {
  for (const bool positive : {true, false}) {
    SCOPED_TRACE(positive ? "positive" : "negative");
    Bench bench(setup);
    const double way = positive ? 1 : -1;
    const std::string function = positive ? "positive_limit" : "negative_limit";
    bench.ready();
    expect_done(bench.client.move_to(50));
    bench.set_input(function, true);
    bench.pass(500ms);
    expect_refused(bench.client.move_by(5 * way), v1::REASON_LIMIT_SWITCH);
    expect_refused(bench.client.jog(5 * way), v1::REASON_LIMIT_SWITCH);
    expect_done(bench.client.move_by(-5 * way));
    bench.set_input(function, false);
    bench.pass(500ms);
    expect_done(bench.client.move_by(5 * way));
    EXPECT_NEAR(bench.shaft().mm, 50, 0.01 + close_to_target(setup));
    bench.finish(3);
  }
  return "yes";
}

constexpr Scenario scenarios[] = {
    {"run_into_limits", "limit switches stop the axis, in both directions", &run_into_limits},
    {"limits_at_standstill", "limit switches block their own direction only", &limits_at_standstill},
};

}  // namespace

std::span<const Scenario> limit_scenarios() { return scenarios; }

}  // namespace axisd::conformance
