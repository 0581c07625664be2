// Power: who may energise the motor, and what is known about it.
#include <gtest/gtest.h>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

std::string enable_and_disable(const Setup& setup) {
  Bench bench(setup);
  const bool energised = setup.on("enabled_at_power_up");
  const auto found = bench.state();
  expect_state(found, energised ? v1::STATE_STANDSTILL : v1::STATE_DISABLED);
  EXPECT_EQ(found.enabled(), energised);
  EXPECT_FALSE(found.enabled_by_daemon());
  if (!energised) expect_refused(bench.client.move_by(1), v1::REASON_DISABLED);

  bench.ready();
  const auto enabled = bench.state();
  expect_state(enabled, v1::STATE_STANDSTILL);
  EXPECT_TRUE(enabled.enabled() && enabled.enabled_by_daemon());
  expect_done(bench.client.move_to(10));

  // While moving: stop, confirm standstill, release.
  const auto move = bench.under_way(bench.client.move_to(300, {}, v1::WAIT_UNTIL_STARTED));
  expect_done(bench.client.disable());
  expect_command(bench.client.look_up(move), v1::COMMAND_STATE_ABORTED, v1::REASON_SUPERSEDED);
  const auto disabled = bench.state();
  expect_state(disabled, v1::STATE_DISABLED);
  EXPECT_FALSE(disabled.enabled());
  // A released open-loop motor can be turned unseen.
  if (!setup.manual.says_yes("closed_loop")) EXPECT_EQ(disabled.trust(), v1::POSITION_TRUST_UNKNOWN);
  expect_refused(bench.client.move_by(1), v1::REASON_DISABLED);
  bench.enable();
  expect_state(bench.state(), v1::STATE_STANDSTILL);
  bench.finish(2);
  return "yes";
}

std::string released_by_terminal(const Setup& setup) {
  Bench bench(setup, {.limit_switches = false, .inputs = {{"motor_free"}}, .homing = ""});
  bench.ready();
  bench.set_input("motor_free", true);
  bench.await([](const auto& s) { return !s.enabled(); }, "released by the terminal");
  expect_state(bench.state(), v1::STATE_DISABLED);
  expect_refused(bench.client.move_by(1), v1::REASON_DISABLED);
  expect_end(bench.client.enable(), v1::COMMAND_STATE_ERROR, v1::REASON_NOT_CONFIRMED);
  bench.set_input("motor_free", false);
  bench.pass(1s);
  expect_done(bench.client.enable());
  bench.ready();
  expect_done(bench.client.move_to(5));
  bench.finish(1);
  return "yes";
}

std::string not_released_by_terminal(const Setup& setup) {
  expect_no_such_plant(
      setup, {.home_switch = false, .limit_switches = false, .inputs = {{"motor_free"}}, .homing = ""},
      "has no input function 'motor_free'");
  return "no";
}

std::string found_energised(const Setup& setup) {
  Bench bench(setup);
  bench.ready();
  expect_done(bench.client.move_to(20));
  bench.target->restart();
  const auto state = bench.await_online();
  expect_state(state, v1::STATE_STANDSTILL);
  EXPECT_TRUE(state.enabled());
  EXPECT_FALSE(state.enabled_by_daemon()) << "this run of the daemon enabled nothing";
  EXPECT_EQ(state.trust(), v1::POSITION_TRUST_RESTORED) << "the drive kept its memory and its position";
  EXPECT_NEAR(state.position(), 20, 0.02);
  bench.finish(1);
  return "yes";
}

constexpr Scenario scenarios[] = {
    {"enable_and_disable", "power stage: enable, disable", &enable_and_disable},
    {"released_by_terminal", "power stage released by a terminal", &released_by_terminal,
     &not_released_by_terminal},
    {"found_energised", "found energised after a restart of the daemon, position kept", &found_energised},
};

}  // namespace

std::span<const Scenario> power_scenarios() { return scenarios; }

}  // namespace axisd::conformance
