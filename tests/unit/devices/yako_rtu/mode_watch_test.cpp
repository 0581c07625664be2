// What the mode register means with both readings of the manuals: it falls back to 0 at the end, or stays.
#include "devices/yako_rtu/mode_watch.hpp"

#include <gtest/gtest.h>

namespace axisd::yako_rtu {
namespace {

using namespace std::chrono_literals;
constexpr auto positioning = DriveMode::positioning;
constexpr auto homing = DriveMode::homing;

class Mode : public ::testing::Test {
 protected:
  DriveMode at_rest(DriveMode mode, bool homed = false) { return look(mode, false, homed); }
  DriveMode moving(DriveMode mode, bool homed = false) { return look(mode, true, homed); }
  DriveMode look(DriveMode mode, bool moves, bool homed) {
    now += 20ms;
    return watch.judge(
        {.asked_at = now, .measured_at = now + 5ms, .mode = mode, .moving = moves, .homed = homed});
  }
  /// Homing as it runs once, and as the bit shows it.
  void home_once(DriveMode afterwards) {
    EXPECT_EQ(moving(homing), homing);
    EXPECT_EQ(moving(homing), homing);
    EXPECT_EQ(at_rest(afterwards, true), positioning) << "done, whatever the register says";
    EXPECT_EQ(at_rest(afterwards, true), positioning);
  }

  TimePoint now{1s};
  ModeWatch watch;
};

TEST_F(Mode, HomingEndsWithItsBitWhetherTheRegisterFallsBackOrNot) {
  for (const auto afterwards : {positioning, homing}) {
    watch = {};
    EXPECT_EQ(at_rest(positioning), positioning);
    home_once(afterwards);
    home_once(afterwards);
  }
}

TEST_F(Mode, HomingThatPausesGoesOn) {
  EXPECT_EQ(at_rest(positioning), positioning);
  EXPECT_EQ(moving(homing), homing);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(at_rest(homing), homing) << "100 ms between its phases";
  EXPECT_EQ(moving(homing), homing);
  EXPECT_EQ(at_rest(homing), homing);
  EXPECT_EQ(at_rest(homing, true), positioning);
}

TEST_F(Mode, HomingThatWasStoppedIsOverWhenTheMotorHasRestedLongEnough) {
  EXPECT_EQ(at_rest(positioning), positioning);
  EXPECT_EQ(moving(homing), homing);
  int samples = 0;
  while (at_rest(homing) == homing) ++samples;
  EXPECT_EQ(samples, 8) << "at 0, 20 ... 140 ms of rest";
  EXPECT_EQ(at_rest(homing), positioning);
}

TEST_F(Mode, ABitThatStaysFromTheLastTimeProvesNoEnd) {
  EXPECT_EQ(at_rest(homing, true), homing) << "nothing is known of a drive that was just found";
  for (int i = 0; i < 8; ++i) (void)at_rest(homing, true);
  EXPECT_EQ(at_rest(homing, true), positioning);
  EXPECT_EQ(moving(homing, true), homing);
  EXPECT_EQ(at_rest(homing, true), homing) << "it may pause";
  for (int i = 0; i < 8; ++i) (void)at_rest(homing, true);
  EXPECT_EQ(at_rest(homing, true), positioning);
}

TEST_F(Mode, HomingThatBeginsAtRestShowsByTheRegisterOrTheBit) {
  EXPECT_EQ(at_rest(positioning, true), positioning);
  EXPECT_EQ(at_rest(homing, true), homing);
  EXPECT_EQ(moving(homing), homing);
  EXPECT_EQ(at_rest(homing, true), positioning);
  EXPECT_EQ(at_rest(homing, false), homing) << "the bit fell: homing began again";
}

TEST_F(Mode, OfSegmentsOnlyMotionTells) {
  for (const auto mode : {DriveMode::multi_position, DriveMode::multi_velocity}) {
    EXPECT_EQ(moving(mode), mode);
    EXPECT_EQ(at_rest(mode), positioning);
    EXPECT_EQ(moving(positioning), positioning);
  }
}

TEST_F(Mode, TheSameSampleAgainChangesNothing) {
  (void)at_rest(positioning);
  (void)moving(homing);
  const DriveSample sample{.asked_at = now + 20ms, .measured_at = now + 25ms, .mode = homing, .homed = true};
  EXPECT_EQ(watch.judge(sample), positioning);
  EXPECT_EQ(watch.judge(sample), positioning);
}

}  // namespace
}  // namespace axisd::yako_rtu
