#include "devices/axis/power_machine.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint now{10s};

DriveSample reading(TimePoint asked, bool enabled, bool moving = false) {
  return {.asked_at = asked, .measured_at = asked + 2ms, .moving = moving, .enabled = enabled};
}

TEST(PowerMachine, WhatACommandEnabledIsOursUntilItIsReleased) {
  PowerMachine power;
  EXPECT_FALSE(power.enabled_by_us()) << "a drive may be found energised";
  power.enabled();
  EXPECT_TRUE(power.enabled_by_us());
  EXPECT_TRUE(power.released(false));
  EXPECT_FALSE(power.enabled_by_us());
}

TEST(PowerMachine, ARestartedDriveIsNotOurs) {
  PowerMachine power;
  power.enabled();
  power.restarted();
  EXPECT_FALSE(power.enabled_by_us());
}

TEST(PowerMachine, ARestartIsRememberedUntilACommandEnablesIt) {
  PowerMachine power;
  power.enabled();
  power.restarted();
  EXPECT_FALSE(power.released(false)) << "no news: nothing of ours was on";
  EXPECT_EQ(power.state(), PowerMachine::State::restarted) << "somebody else may switch it on";
  power.enabled();
  EXPECT_EQ(power.state(), PowerMachine::State::ours);
  EXPECT_TRUE(power.released(false));
  EXPECT_EQ(power.state(), PowerMachine::State::found);
}

TEST(PowerMachine, AReleaseIsNewsOnce) {
  PowerMachine power;
  EXPECT_TRUE(power.released(true)) << "somebody else had enabled it";
  EXPECT_FALSE(power.released(false));
}

TEST(PowerMachine, AReleaseIsOwedUntilAReadingFromThenOnShowsIt) {
  PowerMachine power;
  EXPECT_FALSE(power.look(reading(now, true)));
  power.owe_release(now);
  EXPECT_TRUE(power.owes_release());
  EXPECT_FALSE(power.look(reading(now - 1ms, false)));
  EXPECT_TRUE(power.owes_release()) << "an enable may be on its way";
  EXPECT_TRUE(power.look(reading(now + 1ms, true)));
  EXPECT_TRUE(power.owes_release()) << "until it shows";
  EXPECT_FALSE(power.look(reading(now + 2ms, false)));
  EXPECT_EQ(power.release(), PowerMachine::Release::none);
}

TEST(PowerMachine, AReleaseThatFailsIsGivenUp) {
  PowerMachine power;
  power.owe_release(now);
  power.give_up();
  EXPECT_EQ(power.release(), PowerMachine::Release::none);
  EXPECT_FALSE(power.look(reading(now, true)));
}

using State = EnableMachine::State;

constexpr auto brake = 300ms;

/// A reading that arrives so long after the enable was acknowledged.
State read(EnableMachine& enable, Duration at, bool enabled, bool moving = false, bool elsewhere = false) {
  return enable.look(reading(now + at - 2ms, enabled, moving), elsewhere, now + at);
}

TEST(EnableMachine, TheBrakeIsOpenedWhenTheDriveShowsItsPowerStageAsOn) {
  EnableMachine enable(now, brake);
  EXPECT_EQ(read(enable, 10ms, false), State::waiting);
  EXPECT_EQ(read(enable, 20ms, true), State::opening);
  EXPECT_EQ(read(enable, 319ms, true), State::opening);
  EXPECT_TRUE(enable.goes_on());
  EXPECT_EQ(read(enable, 320ms, true), State::on);
  EXPECT_FALSE(enable.goes_on());
}

TEST(EnableMachine, WithoutABrakeItIsOnAtOnce) {
  EnableMachine enable(now, 0ms);
  EXPECT_EQ(read(enable, 10ms, true), State::on);
  EXPECT_EQ(read(enable, 20ms, true, true), State::on) << "it has ended";
}

TEST(EnableMachine, WhatDoesNotShowWithinASecondIsNotOn) {
  EnableMachine enable(now, brake);
  EXPECT_EQ(read(enable, 999ms, false), State::waiting);
  EXPECT_EQ(read(enable, 1000ms, false), State::not_shown);
}

TEST(EnableMachine, AReadingThatComesLateCounts) {
  EnableMachine enable(now, 0ms);
  EXPECT_EQ(read(enable, 3s, true), State::on);
}

TEST(EnableMachine, WhatGoesOffWhileTheBrakeOpensHasASecondToComeBack) {
  EnableMachine off(now, brake), back(now, brake);
  EXPECT_EQ(read(off, 10ms, true), State::opening);
  EXPECT_EQ(read(off, 1309ms, false), State::opening);
  EXPECT_EQ(read(off, 1310ms, false), State::not_shown);
  EXPECT_EQ(read(back, 10ms, true), State::opening);
  EXPECT_EQ(read(back, 500ms, false), State::opening);
  EXPECT_EQ(read(back, 600ms, true), State::on);
}

TEST(EnableMachine, WhatTurnsWasTurnedByPower) {
  for (const bool moving : {true, false}) {
    EnableMachine waiting(now, brake), opening(now, brake);
    EXPECT_EQ(read(waiting, 10ms, false, moving, !moving), State::turned);
    EXPECT_EQ(read(opening, 10ms, true), State::opening);
    EXPECT_EQ(read(opening, 20ms, true, moving, !moving), State::turned);
  }
}

TEST(EnableMachine, ADriveThatCannotBeReadWhileItsBrakeOpensShowsNothing) {
  EnableMachine enable(now, brake);
  ASSERT_EQ(read(enable, 10ms, true), State::opening);
  enable.silent();
  EXPECT_EQ(enable.state(), State::not_shown);
}

TEST(EnableMachine, ADriveThatCannotBeReadShowsNothing) {
  EnableMachine enable(now, brake);
  enable.silent();
  EXPECT_EQ(enable.state(), State::not_shown);
  EXPECT_FALSE(enable.goes_on());
}

}  // namespace
}  // namespace axisd
