#include "devices/axis/shaft_watch.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = ShaftWatch::State;
using Facts = ShaftWatch::Facts;

constexpr TimePoint now{10s};

/// At rest and under power.
DriveSample at(TimePoint asked) { return {.asked_at = asked, .measured_at = asked + 2ms, .enabled = true}; }
DriveSample moving(bool negative = false) {
  auto sample = at(now);
  sample.moving = true;
  sample.negative_direction = negative;
  return sample;
}
DriveSample in_mode(DriveMode mode) {
  auto sample = at(now);
  sample.mode = mode;
  return sample;
}
DriveSample homed() {
  auto sample = at(now);
  sample.homed = true;
  return sample;
}

/// Looks at a reading and tells whether it shows a loss.
bool shows(ShaftWatch& shaft, const std::optional<DriveSample>& before, const DriveSample& sample,
           const Facts& facts) {
  shaft.look(sample, facts);
  return shaft.shows_loss(before, sample, facts);
}

TEST(ShaftWatch, ADriveThatIsSilentIsOutOfSight) {
  ShaftWatch shaft;
  EXPECT_EQ(shaft.state(), State::seen);
  EXPECT_TRUE(shaft.undisturbed_at(1234));
  shaft.lose_sight({100, 200});
  EXPECT_EQ(shaft.state(), State::unseen);
  EXPECT_TRUE(shaft.undisturbed_at(100));
  EXPECT_TRUE(shaft.undisturbed_at(200));
  EXPECT_FALSE(shaft.undisturbed_at(150));
  shaft.see();
  EXPECT_TRUE(shaft.undisturbed_at(150));
}

TEST(ShaftWatch, ItKnowsTheDirectionOfTheLastMotion) {
  ShaftWatch shaft;
  shaft.look(moving(true), {});
  EXPECT_FALSE(shaft.positive());
  shaft.look(at(now), {});
  EXPECT_FALSE(shaft.positive()) << "it rests";
  shaft.look(moving(true), {.inverted = true});
  EXPECT_TRUE(shaft.positive());
}

TEST(ShaftWatch, HomingThatIsNotOursZeroesTheCounter) {
  ShaftWatch shaft;
  EXPECT_TRUE(shows(shaft, at(now), in_mode(DriveMode::homing), {}));
  EXPECT_FALSE(shows(shaft, at(now), in_mode(DriveMode::homing), {.homes = true}));
}

TEST(ShaftWatch, AHomedBitThatRisesByItselfTellsOfAHoming) {
  ShaftWatch shaft;
  EXPECT_TRUE(shows(shaft, at(now), homed(), {}));
  EXPECT_FALSE(shows(shaft, homed(), homed(), {})) << "it was set before";
  EXPECT_FALSE(shows(shaft, std::nullopt, homed(), {})) << "nobody knows since when";
  EXPECT_FALSE(shows(shaft, at(now), homed(), {.homes = true}));
  shaft.begin_rezeroing();
  EXPECT_TRUE(shaft.rezeroes());
  EXPECT_FALSE(shows(shaft, at(now), homed(), {})) << "a drive may zero its counter by homing on the spot";
  shaft.end_rezeroing();
  EXPECT_TRUE(shows(shaft, at(now), homed(), {}));
}

TEST(ShaftWatch, InOpenLoopALimitInTheDirectionOfTheMotionLosesSteps) {
  ShaftWatch shaft;
  EXPECT_TRUE(shows(shaft, at(now), moving(), {.positive_limit = true}));
  EXPECT_FALSE(shows(shaft, at(now), moving(), {.negative_limit = true}));
  EXPECT_TRUE(shows(shaft, at(now), moving(true), {.negative_limit = true}));
  EXPECT_FALSE(shows(shaft, at(now), moving(), {.closed_loop = true, .positive_limit = true}));
  EXPECT_FALSE(shows(shaft, at(now), moving(), {.homes = true, .positive_limit = true}));
  EXPECT_FALSE(shows(shaft, at(now), at(now), {.positive_limit = true})) << "it rests there";
}

TEST(ShaftWatch, AMotionThatALimitOrAQuickStopHasEndedLostSteps) {
  ShaftWatch shaft;
  shaft.look(moving(), {});
  EXPECT_TRUE(shaft.hides_loss(moving(), at(now), 0, {.positive_limit = true}));
  EXPECT_FALSE(shaft.hides_loss(moving(), at(now), 0, {.negative_limit = true}));
  EXPECT_TRUE(shaft.hides_loss(moving(), at(now), 0, {.quick_stop = true}));
  EXPECT_FALSE(shaft.hides_loss(moving(), at(now), 0, {.closed_loop = true, .quick_stop = true}));
  EXPECT_FALSE(shaft.hides_loss(moving(), moving(), 0, {.quick_stop = true})) << "it still moves";
  EXPECT_FALSE(shaft.hides_loss(in_mode(DriveMode::homing), at(now), 5, {.quick_stop = true}));
}

TEST(ShaftWatch, AMotionBetweenTwoReadingsIsKnownByItsWay) {
  ShaftWatch shaft;
  EXPECT_TRUE(shaft.hides_loss(at(now), at(now), 5, {.positive_limit = true}));
  EXPECT_FALSE(shaft.hides_loss(at(now), at(now), -5, {.positive_limit = true}));
  EXPECT_TRUE(shaft.hides_loss(at(now), at(now), -5, {.inverted = true, .positive_limit = true}));
  EXPECT_FALSE(shaft.hides_loss(at(now), at(now), 0, {.positive_limit = true}));
}

constexpr Facts may_home{
    .closed_loop = true, .homing_terminal = true, .window = 10, .noise = 2, .settling = 300ms};

TEST(ShaftWatch, HomingBetweenTwoReadingsIsKnownByAStepThatNothingExplains) {
  ShaftWatch shaft;
  EXPECT_TRUE(shaft.hides_loss(at(now), at(now), 21, may_home));
  EXPECT_TRUE(shaft.hides_loss(at(now), at(now), -21, may_home));
  EXPECT_FALSE(shaft.hides_loss(at(now), at(now), 20, may_home)) << "so much it wavers";
  EXPECT_FALSE(shaft.hides_loss(moving(), at(now), 21, may_home));
  EXPECT_FALSE(shaft.hides_loss(at(now), moving(), 21, may_home));
  auto no_terminal = may_home;
  no_terminal.homing_terminal = false;
  EXPECT_FALSE(shaft.hides_loss(at(now), at(now), 21, no_terminal));
}

TEST(ShaftWatch, WhatOursTurnedIsExplainedUntilItHasSettled) {
  for (const bool rezeroing : {true, false}) {
    ShaftWatch shaft;
    auto facts = may_home;
    facts.ours = !rezeroing;
    if (rezeroing) shaft.begin_rezeroing();
    shaft.look(at(now), facts);
    EXPECT_FALSE(shaft.hides_loss(at(now), at(now + 300ms), 21, may_home));
    EXPECT_TRUE(shaft.hides_loss(at(now), at(now + 301ms), 21, may_home));
  }
}

TEST(ShaftWatch, AShaftThatIsReleasedMayBeTurnedByHand) {
  ShaftWatch shaft;
  auto released = at(now);
  released.enabled = false;
  EXPECT_FALSE(shaft.hides_loss(released, released, 21, may_home));
  EXPECT_TRUE(shaft.hides_loss(at(now), released, 21, may_home)) << "nothing counts after the release";
  auto counts = may_home;
  counts.counts_released = true;
  EXPECT_FALSE(shaft.hides_loss(at(now), released, 21, counts));
}

}  // namespace
}  // namespace axisd
