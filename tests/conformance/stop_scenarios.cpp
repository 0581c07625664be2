// Stopping: halt, stop, quick stop, and of the whole machine.
#include <gtest/gtest.h>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

/// Under way, with a ramp long enough to do something within it, where the drive has one of its own.
v1::Command long_move(Bench& bench) {
  Motion with{.velocity = 60};
  if (bench.setup.manual.has("one_ramp"))
    with.acceleration_time = 800ms;
  else
    with.deceleration_time = 800ms;
  return bench.under_way(bench.client.move_to(390, with, v1::WAIT_UNTIL_STARTED), 1s);
}

/// It as it ended, however long the drive brakes.
v1::Command await_end(Bench& bench, const v1::Command& command) {
  constexpr int most = 100;
  auto now = command;
  for (int i = 0; i < most && now.state() <= v1::COMMAND_STATE_ACTIVE; ++i) {
    bench.pass(100ms);
    now = bench.client.look_up(command);
  }
  return now;
}

std::string halt(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup);
  bench.ready();
  const auto move = long_move(bench);
  const auto halted = bench.client.halt(v1::WAIT_UNTIL_ACCEPTED);
  EXPECT_TRUE(halted.ok()) << halted.status.error_message();
  bench.pass(100ms);
  expect_done(bench.client.move_to(5));  // takes over from the halt
  expect_command(bench.client.look_up(move), v1::COMMAND_STATE_ABORTED, v1::REASON_SUPERSEDED);
  EXPECT_NEAR(bench.shaft().mm, 5, close);
  EXPECT_EQ(bench.state().trust(), v1::POSITION_TRUST_SET);
  bench.finish(2);
  return "yes";
}

std::string stop(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup);
  bench.ready();
  const auto move = long_move(bench);
  const auto stopping = bench.client.stop(false, v1::WAIT_UNTIL_ACCEPTED);
  EXPECT_TRUE(stopping.ok()) << stopping.status.error_message();
  expect_state(bench.state(), v1::STATE_STOPPING);
  expect_refused(bench.client.move_to(5), v1::REASON_STOPPING);
  expect_command(await_end(bench, stopping.response), v1::COMMAND_STATE_DONE);
  expect_command(bench.client.look_up(move), v1::COMMAND_STATE_ABORTED, v1::REASON_SUPERSEDED);
  expect_state(bench.state(), v1::STATE_STANDSTILL);
  EXPECT_EQ(bench.state().trust(), v1::POSITION_TRUST_SET) << "a stop with a ramp loses no steps";
  EXPECT_NEAR(bench.state().position(), bench.shaft().mm, close);
  expect_done(bench.client.move_to(5));
  bench.finish(2);
  return "yes";
}

std::string stop_with_hold(const Setup& setup) {
  Bench bench(setup);
  bench.ready();
  long_move(bench);
  expect_done(bench.client.stop(true));
  bench.pass(2s);
  expect_state(bench.state(), v1::STATE_STOPPING);
  EXPECT_TRUE(bench.state().stop_held());
  expect_refused(bench.client.move_to(5), v1::REASON_STOPPING);
  EXPECT_TRUE(bench.client.release_stop().ok());
  expect_state(bench.state(), v1::STATE_STANDSTILL);
  expect_done(bench.client.move_to(5));
  bench.finish(2);
  return "yes";
}

std::string quick_stop(const Setup& setup) {
  constexpr double velocity = 60, until_it_is_sent = 6;
  Bench bench(setup);
  bench.ready();
  long_move(bench);
  const auto before = bench.shaft().mm;
  const auto stopped = expect_done(bench.client.quick_stop());
  const auto braking = seconds_of(stopped.granted().deceleration_time());
  if (setup.manual.has("one_halt"))
    EXPECT_GE(braking, 0.75) << "the ramp of the move is all that the drive has";
  else
    EXPECT_LE(braking, 0.101) << "without a ramp, or on that which is set in the drive";
  EXPECT_LT(bench.shaft().mm - before, until_it_is_sent + (velocity * braking / 2));
  const auto state = bench.state();
  expect_state(state, v1::STATE_STANDSTILL);
  EXPECT_EQ(state.trust(),
            setup.manual.says_yes("closed_loop") ? v1::POSITION_TRUST_SET : v1::POSITION_TRUST_UNKNOWN);
  bench.finish(1);
  return "yes";
}

std::string stop_all(const Setup& setup) {
  Bench bench(setup);
  bench.ready();
  long_move(bench);
  v1::StopAllRequest all;
  all.set_wait_until(v1::WAIT_UNTIL_DONE);
  const auto stopped = bench.client.call(&v1::SystemService::Stub::StopAll, all);
  EXPECT_TRUE(stopped.ok()) << stopped.status.error_message();
  if (stopped->results_size() != 1) throw Broken("StopAll: " + stopped->ShortDebugString());
  expect_command(stopped->results(0).command(), v1::COMMAND_STATE_DONE);
  EXPECT_FALSE(bench.shaft().moving);
  expect_refused(bench.client.move_to(5), v1::REASON_INHIBITED);
  bench.target->restart();
  EXPECT_TRUE(bench.await_online().inhibited()) << "the inhibit has to survive a restart";
  expect_refused(bench.client.move_to(5), v1::REASON_INHIBITED);
  EXPECT_TRUE(bench.client.call(&v1::SystemService::Stub::ReleaseStopAll, v1::ReleaseStopAllRequest()).ok());
  bench.ready();
  expect_done(bench.client.move_by(5));
  bench.finish(2);
  return "yes";
}

/// A stop in homing: the manuals define it for position and speed mode only (M13), so it is escalated.
std::string stop_while_homing(const Setup& setup) {
  Bench bench(setup, {.keys = "    stop_escalation: release\n"});
  bench.enable();
  const auto home = bench.under_way(bench.client.home(v1::WAIT_UNTIL_STARTED));
  expect_state(bench.state(), v1::STATE_HOMING);
  expect_done(bench.client.stop());
  EXPECT_FALSE(bench.shaft().moving);
  expect_command(bench.client.look_up(home), v1::COMMAND_STATE_ABORTED, v1::REASON_SUPERSEDED);
  EXPECT_EQ(bench.state().trust(), v1::POSITION_TRUST_UNKNOWN) << "half a homing is none";
  bench.finish(1);
  return "yes";
}

constexpr Scenario scenarios[] = {
    {"halt", "halt, a new move may take over", &halt},
    {"stop", "stop, nothing takes over", &stop},
    {"stop_with_hold", "stop with hold until released", &stop_with_hold},
    {"quick_stop", "quick stop", &quick_stop},
    {"stop_all", "stop of the whole machine, latched", &stop_all},
    {"stop_while_homing", "stop while homing", &stop_while_homing},
};

}  // namespace

std::span<const Scenario> stop_scenarios() { return scenarios; }

}  // namespace axisd::conformance
