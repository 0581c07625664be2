// Power cycles of the drive, restarts of the daemon: what is known afterwards, and that nothing moves by
// itself.
#include <gtest/gtest.h>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

void expect_lost(Bench& bench) {
  const auto state = bench.await_online();
  EXPECT_EQ(state.trust(), v1::POSITION_TRUST_UNKNOWN) << "the drive lost its counter";
  EXPECT_FALSE(state.enabled_by_daemon());
  EXPECT_EQ(state.drift(), "");
  bool configured = false;
  for (const auto& input : state.inputs()) configured = configured || input.function() == "home";
  EXPECT_EQ(configured, !bench.setup.manual.list("inputs").empty());
}

std::string power_cycle_at_rest(const Setup& setup) {
  for (const Duration off : {Duration(1ms), Duration(200ms), Duration(5s)}) {
    Bench bench(setup);
    bench.ready();
    expect_done(bench.client.move_to(30));
    bench.cycle_power(off);
    bench.pass(3s);
    expect_lost(bench);
    expect_state(bench.state(), setup.on("enabled_at_power_up") ? v1::STATE_STANDSTILL : v1::STATE_DISABLED);
    // The configuration is back: the switches work, and so does homing.
    bench.enable();
    expect_done(bench.client.home());
    bench.finish(2);
  }
  return "yes";
}

std::string power_cycle_in_motion(const Setup& setup) {
  for (const Duration off : {Duration(1ms), Duration(5s)}) {
    Bench bench(setup);
    bench.ready();
    const auto move = bench.under_way(bench.client.move_to(300, {}, v1::WAIT_UNTIL_STARTED));
    bench.cycle_power(off);
    bench.pass(5s);
    EXPECT_NE(bench.client.look_up(move).state(), v1::COMMAND_STATE_DONE);
    EXPECT_GE(bench.client.look_up(move).state(), v1::COMMAND_STATE_ABORTED);
    EXPECT_FALSE(bench.shaft().moving);
    expect_lost(bench);
    if (bench.state().state() == v1::STATE_ERROR_STOP) expect_done(bench.client.reset());
    bench.ready();
    expect_done(bench.client.move_to(5));
    bench.finish(2);
  }
  return "yes";
}

/// The daemon was away while the drive was switched off and on: its continuity cannot be proven (M20).
std::string restart_and_power_cycle(const Setup& setup) {
  Bench bench(setup);
  bench.ready();
  expect_done(bench.client.move_to(30));
  bench.outside("power @1 off");
  bench.target->restart();
  bench.outside("power @1 on");
  bench.pass(3s);
  expect_lost(bench);
  // Until a client enables it, also where it came up energised (M1).
  expect_refused(bench.client.move_to(1), v1::REASON_DISABLED);
  bench.finish(1);
  return "yes";
}

std::string restarts(const Setup& setup) {
  Bench bench(setup);
  bench.enable();
  expect_done(bench.client.home());
  expect_done(bench.client.move_to(77));
  for (int i = 0; i < 2; ++i) {
    bench.target->restart();
    const auto state = bench.await_online();
    EXPECT_EQ(state.trust(), v1::POSITION_TRUST_RESTORED);
    EXPECT_NEAR(state.position(), 77, 0.06);
  }
  expect_done(bench.client.move_to(80));
  bench.finish(3);
  return "yes";
}

constexpr Scenario scenarios[] = {
    {"power_cycle_at_rest", "power cycle noticed, configuration applied again", &power_cycle_at_rest},
    {"power_cycle_in_motion", "power cycle in motion: nothing resumes", &power_cycle_in_motion},
    {"restart_and_power_cycle", "power cycle while the daemon was away noticed", &restart_and_power_cycle},
    {"restarts", "position kept over restarts of the daemon", &restarts},
};

}  // namespace

std::span<const Scenario> reboot_scenarios() { return scenarios; }

}  // namespace axisd::conformance
