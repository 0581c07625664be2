// Moves: absolute, relative, endless, jogging, and one that replaces another.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

std::string absolute_moves(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup);
  bench.enable();
  expect_refused(bench.client.move_to(10), v1::REASON_NOT_TRUSTED);
  bench.ready();
  const auto far = expect_done(bench.client.move_to(120, {.velocity = 50.4}));
  EXPECT_LE(far.granted().velocity(), 50.4);
  EXPECT_GT(far.granted().velocity(), 50);
  EXPECT_NEAR(bench.shaft().mm, 120, close);
  EXPECT_NEAR(bench.state().position(), 120, close);
  expect_done(bench.client.move_to(120));  // it is there: nothing is sent
  const auto back = expect_done(bench.client.move_to(0));
  EXPECT_DOUBLE_EQ(back.granted().velocity(), 100);
  EXPECT_NEAR(bench.shaft().mm, 0, close);
  const auto beyond = expect_refused(bench.client.move_to(400.1), v1::REASON_SOFT_LIMIT);
  EXPECT_EQ(beyond.permitted().maximum(), 400);
  const auto fast = expect_refused(bench.client.move_to(50, {.velocity = 101}), v1::REASON_OUT_OF_RANGE);
  EXPECT_NEAR(fast.permitted().maximum(), 100, 1e-9);
  const std::chrono::milliseconds longest(
      setup.manual.has("time_range") ? setup.manual.range("time_range").second : 2000);
  expect_refused(bench.client.move_to(50, {.acceleration_time = longest + 1ms}), v1::REASON_OUT_OF_RANGE);
  bench.finish(2);
  return "yes";
}

std::string relative_moves(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup);
  bench.ready();
  for (int i = 0; i < 6; ++i) expect_done(bench.client.move_by(100.0 / 3));
  EXPECT_NEAR(bench.shaft().mm, 200, close) << "thirds do not add up";
  expect_done(bench.client.move_by(-50));
  EXPECT_NEAR(bench.shaft().mm, 150, close);
  bench.under_way(bench.client.move_by(100, {}, v1::WAIT_UNTIL_STARTED));
  expect_refused(bench.client.move_by(1), v1::REASON_MOVING);
  bench.pass(5s);
  EXPECT_NEAR(bench.shaft().mm, 250, close);
  bench.finish(8);
  return "yes";
}

std::string velocity_moves(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup, {.limits = false});
  bench.ready();
  int starts = 0;
  for (const double velocity : {40.0, -40.0}) {
    const auto before = bench.shaft().mm;
    const auto run = bench.under_way(bench.client.velocity(velocity), 800ms);
    const auto state = bench.state();
    expect_state(state, v1::STATE_CONTINUOUS_MOTION);
    EXPECT_EQ(state.motion_cause(), v1::MOTION_CAUSE_COMMAND);
    EXPECT_EQ(state.velocity() > 0, velocity > 0);
    EXPECT_EQ(state.positive_direction(), velocity > 0);
    EXPECT_EQ(bench.shaft().mm > before, velocity > 0);
    expect_done(bench.client.halt());
    expect_command(bench.client.look_up(run), v1::COMMAND_STATE_ABORTED, v1::REASON_SUPERSEDED);
    EXPECT_NEAR(bench.state().position(), bench.shaft().mm, close);
    ++starts;
  }
  bench.finish(starts);
  return "yes";
}

/// M16: with limits and a trusted position, an endless motion ends at the software limit, whoever is dead
/// then.
std::string velocity_to_the_software_limit(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup);
  bench.ready();
  expect_done(bench.client.move_to(350));
  const auto run = bench.client.velocity(80, {}, v1::WAIT_UNTIL_DONE);
  expect_end(run, v1::COMMAND_STATE_ABORTED, v1::REASON_SOFT_LIMIT);
  EXPECT_NEAR(bench.shaft().mm, 400, close);
  expect_refused(bench.client.velocity(10), v1::REASON_SOFT_LIMIT);
  bench.under_way(bench.client.velocity(-80));
  bench.outside("cut");
  bench.pass(10s);
  EXPECT_NEAR(bench.shaft().mm, 0, close) << "the cable is cut: the drive has to end at the limit by itself";
  bench.outside("join");
  bench.await_online();
  bench.finish(3);
  return "yes";
}

std::string jogging(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup);
  bench.ready();
  const auto jog = bench.client.jog(30, {.hold = 300ms});
  bench.under_way(jog, 200ms);
  for (int i = 0; i < 6; ++i) {
    const auto again = bench.client.jog(30, {.hold = 300ms});
    EXPECT_EQ(again->id(), jog->id()) << "a repeated jog extends the first";
    bench.pass(200ms);
  }
  expect_state(bench.state(), v1::STATE_CONTINUOUS_MOTION);
  const auto braking = seconds_of(jog->granted().deceleration_time());
  bench.pass(1s + std::chrono::milliseconds(std::lround(1000 * braking)));
  expect_command(bench.client.look_up(jog.response), v1::COMMAND_STATE_ABORTED);
  expect_state(bench.state(), v1::STATE_STANDSTILL);
  EXPECT_NEAR(bench.state().position(), bench.shaft().mm, close);
  EXPECT_NEAR(bench.shaft().mm, 30 * (1.5 + (braking / 2)), 6);
  bench.finish(1);
  return "yes";
}

/// M16: an axis that does not know where it is jogs a bounded way.
std::string jogging_untrusted(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup);
  bench.enable();
  for (const double velocity : {30.0, -30.0}) {
    const auto before = bench.shaft().mm;
    expect_refused(bench.client.velocity(velocity), v1::REASON_NOT_TRUSTED);
    expect_end(bench.client.jog(velocity, {.hold = 2s}, v1::WAIT_UNTIL_DONE), v1::COMMAND_STATE_DONE);
    EXPECT_NEAR(bench.shaft().mm - before, velocity > 0 ? 10 : -10, close);
  }
  bench.finish(2);
  return "yes";
}

std::string replaced_moves(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup);
  bench.ready();
  const auto first = bench.under_way(bench.client.move_to(300, {}, v1::WAIT_UNTIL_STARTED), 1s);
  expect_state(bench.state(), v1::STATE_DISCRETE_MOTION);
  expect_done(bench.client.move_to(20));
  expect_command(bench.client.look_up(first), v1::COMMAND_STATE_ABORTED, v1::REASON_SUPERSEDED);
  EXPECT_NEAR(bench.shaft().mm, 20, close);
  bench.finish(2);
  return "yes";
}

std::string buffered_moves(const Setup& setup) {
  const double close = close_to_target(setup);
  Bench bench(setup);
  bench.ready();
  const auto first = bench.client.move_to(60, {}, v1::WAIT_UNTIL_ACCEPTED);
  const auto second = bench.client.move_to(20, {.buffered = true}, v1::WAIT_UNTIL_ACCEPTED);
  const auto third = bench.client.move_by(30, {.buffered = true}, v1::WAIT_UNTIL_ACCEPTED);
  expect_command(bench.client.look_up(second.response), v1::COMMAND_STATE_ACCEPTED);
  EXPECT_NEAR(third->granted().position(), 50, close) << "its base is the target of the one before";
  const auto last = expect_done(bench.client.move_by(10, {.buffered = true}));
  for (const auto& done : {first, second, third})
    expect_command(bench.client.look_up(done.response), v1::COMMAND_STATE_DONE);
  EXPECT_GE(from_proto(last.started_at()), from_proto(bench.client.look_up(third.response).ended_at()));
  EXPECT_NEAR(bench.shaft().mm, 60, close);
  // A stop ends all of it.
  bench.under_way(bench.client.move_to(300, {}, v1::WAIT_UNTIL_STARTED));
  const auto waiting = bench.client.move_to(0, {.buffered = true}, v1::WAIT_UNTIL_ACCEPTED);
  expect_done(bench.client.stop());
  expect_command(bench.client.look_up(waiting.response), v1::COMMAND_STATE_ABORTED, v1::REASON_SUPERSEDED);
  expect_refused(bench.client.jog(5, {.buffered = true}), v1::REASON_NOT_SUPPORTED);
  bench.pass(3s);
  expect_state(bench.state(), v1::STATE_STANDSTILL);
  bench.finish(5);
  return "yes";
}

constexpr Scenario scenarios[] = {
    {"absolute_moves", "absolute moves in user units, software limits", &absolute_moves},
    {"relative_moves", "relative moves without drift", &relative_moves},
    {"velocity_moves", "endless motion in both directions", &velocity_moves},
    {"velocity_to_the_software_limit", "endless motion ends at the software limit",
     &velocity_to_the_software_limit},
    {"jogging", "jog while renewed", &jogging},
    {"jogging_untrusted", "bounded jog without a known position", &jogging_untrusted},
    {"replaced_moves", "a move replaces another", &replaced_moves},
    {"buffered_moves", "moves wait for the one before", &buffered_moves},
};

}  // namespace

double index_by_thirds(const Setup& setup, int count) {
  Bench bench(
      setup,
      {.limits = false, .home_switch = false, .limit_switches = false, .mechanics = false, .homing = ""});
  bench.ready();
  for (int i = 0; i < count; ++i) {
    const auto moved = bench.client.move_by(1.0 / 3);
    if (!moved.ok() || moved->state() != v1::COMMAND_STATE_DONE)
      throw Broken(fmt::format("move {} of {}: {}", i + 1, count,
                               moved.ok() ? describe(moved.response) : moved.status.error_message()));
  }
  bench.finish(count);
  return bench.shaft().mm;
}

RandomMoves move_at_random(const Setup& setup, int count) {
  Bench bench(
      setup,
      {.limits = false, .home_switch = false, .limit_switches = false, .mechanics = false, .homing = ""});
  bench.ready();
  std::mt19937 random(static_cast<std::uint32_t>(count));
  // As many of a fraction of a pulse as of a few pulses, tenths of mm, and mm.
  const auto distance = [&random] {
    const auto size = std::pow(10.0, std::uniform_real_distribution(-3.0, 0.8)(random));
    return std::bernoulli_distribution(0.5)(random) ? size : -size;
  };
  RandomMoves result;
  double asked = 0, least = 0, most = 0;
  for (int i = 0; i < count; ++i) {
    const auto mm = distance();
    const auto moved = bench.client.move_by(mm);
    if (!moved.ok() || moved->state() != v1::COMMAND_STATE_DONE) {
      if (++result.refused == 1)
        result.first_refusal = moved.ok() ? describe(moved.response) : moved.status.error_message();
      asked = bench.shaft().mm - most;
      continue;
    }
    asked += mm;
    // By how much the first reading of an encoder was off stays: that is no drift.
    const auto beside = bench.shaft().mm - asked;
    least = i == 0 ? beside : std::min(least, beside);
    most = i == 0 ? beside : std::max(most, beside);
  }
  result.drift_pulses = (most - least) * pulses_per_mm(setup.manual);
  return result;
}

std::span<const Scenario> motion_scenarios() { return scenarios; }

}  // namespace axisd::conformance
