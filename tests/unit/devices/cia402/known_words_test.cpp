#include "devices/cia402/known_words.hpp"

#include <gtest/gtest.h>

namespace axisd::cia402 {
namespace {

using std::chrono::milliseconds;
using Control = KnownWords::Control;
using Halt = KnownWords::Halt;

constexpr std::uint16_t enabled = 0x000F, switched_on = 0x0007, halted = 0x010F, started = 0x001F;

class Words : public testing::Test {
 protected:
  [[nodiscard]] static TimePoint at(int ms) { return TimePoint{} + milliseconds(ms); }
  [[nodiscard]] static KnownWords::Moment moment(int ms) { return {.at = at(ms), .losses = 0}; }
  /// Written and confirmed.
  void write(std::uint16_t word, int ms) {
    (void)words_.begin_write(word);
    words_.end_write(at(ms));
    words_.executed(word);
    words_.confirm(word, moment(ms));
  }

  KnownWords words_{OperationMode::profile_velocity};
};

TEST_F(Words, NothingIsKnownAtFirst) {
  EXPECT_EQ(words_.knows(), Control::unknown);
  EXPECT_EQ(words_.halt(), Halt::none);
  EXPECT_FALSE(words_.mode());
}

TEST_F(Words, AConfirmedWriteIsKnown) {
  write(enabled, 1);
  EXPECT_EQ(words_.knows(), Control::whole);
  EXPECT_EQ(words_.control(), enabled);
}

TEST_F(Words, WhatWasReadIsKnown) {
  words_.take_read(halted, words_.newest(), moment(1));
  EXPECT_EQ(words_.control(), halted);
  EXPECT_EQ(words_.state_bits(), enabled);
}

TEST_F(Words, WhatWasReadBeforeAWriteIsNot) {
  const auto newest = words_.newest();
  (void)words_.begin_write(enabled);
  words_.take_read(switched_on, newest, moment(1));
  EXPECT_EQ(words_.knows(), Control::unknown);
}

TEST_F(Words, BitsThatAreTheSameBeforeAndAfterAWriteStayKnown) {
  write(enabled, 1);
  (void)words_.begin_write(halted);
  EXPECT_EQ(words_.knows(), Control::state_bits);
}

TEST_F(Words, OtherBitsAreUnknownWhileTheyAreWritten) {
  write(enabled, 1);
  (void)words_.begin_write(switched_on);
  EXPECT_EQ(words_.knows(), Control::unknown);
}

TEST_F(Words, AWordThatWaitsForASyncLeavesTheBits) {
  write(enabled, 1);
  (void)words_.begin_write(std::nullopt);
  EXPECT_EQ(words_.knows(), Control::state_bits);
}

TEST_F(Words, AWriteThatWasOvertakenIsNotTheNewest) {
  const auto first = words_.begin_write(enabled);
  const auto second = words_.begin_write(halted);
  EXPECT_FALSE(words_.is_newest(first));
  EXPECT_TRUE(words_.is_newest(second));
}

TEST_F(Words, AnotherStateThanThatOfTheWordLeavesItsOwnBits) {
  write(enabled, 1);
  words_.see_state(State::switched_on, moment(2));
  EXPECT_EQ(words_.knows(), Control::state_bits);
  EXPECT_EQ(words_.state_bits(), switched_on);
}

TEST_F(Words, AReleasedDriveHoldsNoneOfTheBits) {
  write(enabled, 1);
  words_.see_state(State::switch_on_disabled, moment(2));
  EXPECT_EQ(words_.knows(), Control::unknown);
}

TEST_F(Words, AnEnergisedStateTellsItsBits) {
  words_.see_state(State::operation_enabled, moment(1));
  EXPECT_EQ(words_.knows(), Control::state_bits);
  EXPECT_EQ(words_.state_bits(), enabled);
}

TEST_F(Words, AStateOfBeforeTheEndOfAWriteTellsNothing) {
  write(enabled, 5);
  words_.see_state(State::switch_on_disabled, moment(5));
  EXPECT_EQ(words_.control(), enabled);
  (void)words_.begin_write(halted);
  words_.see_state(State::switch_on_disabled, moment(9));
  EXPECT_EQ(words_.state_bits(), enabled);
}

TEST_F(Words, KnowledgeLastsForASecond) {
  write(enabled, 0);
  words_.forget_stale(moment(1000));
  EXPECT_EQ(words_.knows(), Control::whole);
  words_.forget_stale(moment(1001));
  EXPECT_EQ(words_.knows(), Control::unknown);
}

TEST_F(Words, WhatTheDriveShowsMakesItLast) {
  write(enabled, 0);
  words_.see_state(State::operation_enabled, moment(900));
  words_.forget_stale(moment(1800));
  EXPECT_EQ(words_.control(), enabled);
}

TEST_F(Words, ALostPortEndsIt) {
  write(enabled, 0);
  words_.forget_stale({.at = at(1), .losses = 1});
  EXPECT_EQ(words_.knows(), Control::unknown);
}

TEST_F(Words, AHaltBrakesUntilTheMotorWasSeenAtRestUnderIt) {
  words_.halted(at(10), false);
  EXPECT_EQ(words_.halt(), Halt::braking);
  words_.see_rest(at(9));
  EXPECT_EQ(words_.halt(), Halt::braking);
  words_.see_rest(at(10));
  EXPECT_EQ(words_.halt(), Halt::rested);
}

TEST_F(Words, AWordWithoutItMayHaveEndedTheHalt) {
  words_.halted(at(10), true);
  words_.executed(halted);
  EXPECT_TRUE(words_.halt_is_quick());
  words_.executed(started);
  EXPECT_EQ(words_.halt(), Halt::none);
  EXPECT_FALSE(words_.halt_is_quick());
}

TEST_F(Words, AHaltThatWasFoundStandsAsLongAsTheWordIsKnown) {
  EXPECT_FALSE(words_.held_halt(at(5)));
  words_.take_read(halted, words_.newest(), moment(1));
  EXPECT_TRUE(words_.held_halt(at(5)));
  words_.doubt_control();
  EXPECT_FALSE(words_.held_halt(at(5)));
}

TEST_F(Words, UnderAHaltOfOursItIsHeldFromItsEdgeOn) {
  words_.halted(at(10), false);
  EXPECT_FALSE(words_.held_halt(at(9)));
  EXPECT_TRUE(words_.held_halt(at(10)));
  words_.see_rest(at(11));
  words_.halted(at(20), true);
  EXPECT_EQ(words_.halt(), Halt::braking) << "a second edge";
}

TEST_F(Words, AHaltThatWasWrittenIsHeldFromTheEndOfTheWriteOn) {
  write(halted, 10);
  EXPECT_FALSE(words_.held_halt(at(9)));
  EXPECT_TRUE(words_.held_halt(at(10)));
}

TEST_F(Words, WhatIsReadDuringAWriteIsNotKnown) {
  (void)words_.begin_write(std::nullopt);
  words_.take_read(enabled, words_.newest(), moment(1));
  EXPECT_EQ(words_.knows(), Control::unknown);
  words_.end_write(at(2));
  words_.take_read(started, words_.newest(), moment(3));
  EXPECT_EQ(words_.control(), started);
}

TEST_F(Words, BitsThatWereTakenAreKnown) {
  words_.take_bits(switched_on);
  EXPECT_EQ(words_.knows(), Control::state_bits);
  EXPECT_EQ(words_.state_bits(), switched_on);
}

TEST_F(Words, AnOlderProofTakesNothingFromANewerOne) {
  write(enabled, 900);
  words_.see_state(State::operation_enabled, moment(901));
  words_.take_read(enabled, words_.newest(), moment(100));
  words_.forget_stale(moment(1900));
  EXPECT_EQ(words_.knows(), Control::whole);
}

TEST_F(Words, OfTheModeTheNewestCounts) {
  words_.mode_reached(OperationMode::profile_position, at(5));
  words_.see_mode(OperationMode::homing, at(5));
  EXPECT_EQ(words_.mode(), OperationMode::profile_position);
  words_.see_mode(OperationMode::homing, at(6));
  EXPECT_EQ(words_.mode(), OperationMode::homing);
  EXPECT_TRUE(words_.homes());
  words_.leave_mode();
  EXPECT_FALSE(words_.mode());
}

TEST_F(Words, TheNeutralModeIsOneUntilAnotherWasReached) {
  words_.use_mode(KnownWords::ModeUse::neutral);
  words_.mode_reached(OperationMode::profile_velocity, at(5));
  EXPECT_TRUE(words_.may_be_neutral(at(9)));
  words_.mode_reached(OperationMode::profile_position, at(10));
  EXPECT_TRUE(words_.may_be_neutral(at(10))) << "it was asked for on the way";
  EXPECT_FALSE(words_.may_be_neutral(at(11)));
}

TEST_F(Words, ADriveThatShowsAnotherModeForLongIsNotOnItsWayToTheNeutralOne) {
  words_.mode_written(at(0));
  words_.use_mode(KnownWords::ModeUse::neutral);
  words_.see_mode(OperationMode::profile_position, at(500));
  EXPECT_TRUE(words_.may_be_neutral(at(500)));
  words_.see_mode(OperationMode::profile_position, at(501));
  EXPECT_FALSE(words_.may_be_neutral(at(501)));
}

TEST_F(Words, ForgottenIsAllButTheHalt) {
  write(halted, 1);
  words_.halted(at(1), false);
  words_.mode_reached(OperationMode::profile_position, at(1));
  words_.set_halt_option(1);
  words_.use_mode(KnownWords::ModeUse::neutral);
  words_.forget();
  EXPECT_EQ(words_.knows(), Control::unknown);
  EXPECT_FALSE(words_.mode());
  EXPECT_EQ(words_.mode_use(), KnownWords::ModeUse::motion);
  EXPECT_FALSE(words_.halt_option());
  EXPECT_EQ(words_.halt(), Halt::braking);
  words_.forget_halt();
  EXPECT_EQ(words_.halt(), Halt::none);
}

}  // namespace
}  // namespace axisd::cia402
