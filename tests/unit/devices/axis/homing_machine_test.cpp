#include "devices/axis/homing_machine.hpp"

#include <gtest/gtest.h>

#include "devices/axis/motion_machine.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = HomingMachine::State;

constexpr TimePoint started{10s};

Scale scale() { return Scale({.pulses_per_revolution = 1000}); }

/// At 1 rev/s, from a counter far from home.
HomingMachine::Homing homing() {
  return {.since = started,
          .timeout = 5s,
          .fastest = 1000,
          .max_travel = 2,
          .origin = 50'000,
          .asked_at = started - 10ms};
}

/// Readings by the time since the start; each takes 2 ms.
struct Followed {
  explicit Followed(const HomingMachine::Homing& how = homing())
      : machine(how, scale()), bit(how.homed_before) {}

  State read(Duration at, DriveMode mode, bool moving, bool homed, std::int32_t counter,
             bool held_up = false) {
    const DriveSample sample{.asked_at = started + at,
                             .measured_at = started + at + 2ms,
                             .mode = mode,
                             .moving = moving,
                             .homed = homed,
                             .position_pulses = counter};
    return machine.look({.sample = sample, .counter = sample.position_pulses, .held_up = held_up},
                        sample.measured_at);
  }
  /// Homing mode, in motion, the bit as it was.
  State searches(Duration at, std::int32_t counter = 50'000) {
    return read(at, DriveMode::homing, true, bit, counter);
  }
  State rests(Duration at, bool homed, std::int32_t counter, bool held_up = false) {
    return read(at, DriveMode::positioning, false, homed, counter, held_up);
  }

  HomingMachine machine;
  bool bit;
};

/// The bit is left from the last time.
HomingMachine::Homing again() {
  auto how = homing();
  how.homed_before = true;
  return how;
}

TEST(HomingMachine, WhatWasReadBeforeTheStartCountsForNothing) {
  Followed followed;
  EXPECT_EQ(followed.searches(-1ms), State::starting);
  EXPECT_EQ(followed.searches(0ms), State::searching);
}

TEST(HomingMachine, TheRiseOfTheBitAtRestIsHome) {
  Followed followed;
  followed.searches(10ms);
  EXPECT_EQ(followed.read(20ms, DriveMode::positioning, true, true, 0), State::searching) << "it moves";
  EXPECT_EQ(followed.read(30ms, DriveMode::homing, false, true, 0), State::searching)
      << "a rest between two phases";
  EXPECT_EQ(followed.rests(40ms, true, 0), State::home);
  EXPECT_EQ(followed.rests(50ms, false, 700), State::home) << "it has ended";
}

TEST(HomingMachine, AHomingTooShortToBeSeenIsKnownByTheRiseOfItsBit) {
  Followed followed;
  EXPECT_EQ(followed.rests(10ms, true, 0), State::home);
}

TEST(HomingMachine, ABitOfTheLastTimeIsNoStart) {
  Followed followed(again());
  EXPECT_EQ(followed.rests(10ms, true, 0), State::starting);
  EXPECT_EQ(followed.rests(start_window, true, 0), State::did_not_start);
}

TEST(HomingMachine, ABitThatWasLowInBetweenHasRisen) {
  Followed followed(again());
  EXPECT_EQ(followed.rests(10ms, false, 700), State::starting);
  EXPECT_EQ(followed.rests(20ms, true, 700), State::home);
}

TEST(HomingMachine, WithoutARiseTheCounterAtHomeTells) {
  Followed at_zero(again()), elsewhere(again());
  at_zero.searches(10ms);
  EXPECT_EQ(at_zero.rests(20ms, true, 1), State::home);
  elsewhere.searches(10ms);
  EXPECT_EQ(elsewhere.rests(20ms, true, 2), State::not_reached);
  auto compensated = again();
  compensated.offset_pulses = -300;
  Followed at_offset(compensated);
  at_offset.searches(10ms);
  EXPECT_EQ(at_offset.rests(20ms, true, -299), State::home);
}

TEST(HomingMachine, AStopTerminalMayHaveEndedItAtHome) {
  Followed followed(again());
  followed.searches(10ms);
  EXPECT_EQ(followed.rests(20ms, true, 0, true), State::not_reached);
}

TEST(HomingMachine, RestWithoutTheBitIsNotHome) {
  Followed followed;
  followed.searches(10ms);
  EXPECT_EQ(followed.rests(20ms, false, 0), State::not_reached);
}

TEST(HomingMachine, AMeasuredPositionComesHomeLate) {
  auto measured = again();
  measured.window = 10;
  Followed settles(measured), never(measured);
  settles.searches(10ms);
  EXPECT_EQ(settles.rests(20ms, true, 40), State::settling);
  EXPECT_EQ(settles.rests(500ms, true, 10), State::home);
  never.searches(10ms);
  EXPECT_EQ(never.rests(20ms, true, 40), State::settling);
  EXPECT_EQ(never.rests(520ms - 1ms, true, 40), State::settling);
  EXPECT_EQ(never.rests(520ms, true, 40), State::not_reached);
}

TEST(HomingMachine, WhatMovesAgainIsSearching) {
  auto measured = again();
  measured.window = 10;
  Followed followed(measured);
  followed.searches(10ms);
  EXPECT_EQ(followed.rests(20ms, true, 40), State::settling);
  EXPECT_EQ(followed.searches(30ms, 40), State::searching);
}

TEST(HomingMachine, NeitherModeNorBitWithinTheStartWindowIsNoStart) {
  Followed followed;
  EXPECT_EQ(followed.rests(start_window - 1ms, false, 50'000), State::starting);
  EXPECT_EQ(followed.rests(start_window, false, 50'000), State::did_not_start);
}

TEST(HomingMachine, ItGoesNoFurtherThanMaxTravel) {
  Followed followed;
  EXPECT_EQ(followed.searches(0ms, 50'000), State::searching);
  EXPECT_EQ(followed.searches(1000ms, 51'000), State::searching);
  EXPECT_EQ(followed.searches(2000ms, 52'000), State::searching);
  EXPECT_EQ(followed.searches(2010ms, 52'010), State::too_far);
}

TEST(HomingMachine, ACounterThatTheDriveSetsIsNoTravel) {
  Followed followed;
  EXPECT_EQ(followed.searches(0ms, 50'000), State::searching);
  EXPECT_EQ(followed.searches(1000ms, 51'000), State::searching);
  EXPECT_EQ(followed.searches(1010ms, 0), State::searching);
  EXPECT_EQ(followed.searches(2000ms, 990), State::searching);
  EXPECT_EQ(followed.searches(2020ms, 1010), State::too_far) << "the way before it counts";
}

TEST(HomingMachine, WhatIsNoHomingGoesNoFurtherEither) {
  Followed followed;
  const auto moves = [&](Duration at, std::int32_t counter) {
    return followed.read(at, DriveMode::positioning, true, false, counter);
  };
  EXPECT_EQ(moves(0ms, 50'000), State::starting);
  EXPECT_EQ(moves(400ms, 50'300), State::starting);
  auto short_of_it = homing();
  short_of_it.max_travel = 0.25;
  Followed shorter(short_of_it);
  EXPECT_EQ(shorter.read(400ms, DriveMode::positioning, true, false, 50'300), State::too_far);
}

TEST(HomingMachine, ADriveThatTellsNothingSinceItsStartEndsWhenItsTimeIsOver) {
  Followed followed;
  const DriveSample old{.asked_at = started - 10ms, .measured_at = started - 8ms};
  EXPECT_EQ(followed.machine.look({.sample = old}, started + 5s - 1ms), State::starting);
  EXPECT_EQ(followed.machine.look({.sample = old}, started + 5s), State::took_too_long);
}

TEST(HomingMachine, ItEndsWhenItsTimeIsOver) {
  auto endless = homing();
  endless.max_travel.reset();
  Followed followed(endless);
  EXPECT_EQ(followed.machine.latest(), started + 5s);
  EXPECT_EQ(followed.searches(5s - 3ms), State::searching);
  EXPECT_EQ(followed.searches(5s - 2ms), State::took_too_long) << "by the time at which it is looked at";
}

}  // namespace
}  // namespace axisd
