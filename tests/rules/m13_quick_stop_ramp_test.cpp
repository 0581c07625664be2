// M12 and M13: a quick stop of a CiA 402 drive that brakes on a ramp is given the time of that ramp.
#include <gtest/gtest.h>

#include "tests/rules/model_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t halt_option = 0x605D00, deceleration = 0x608400, quick_stop_ramp = 0x608500;

ModelRigOptions halting_in_one_way() {
  return {.model = "cia402", .limits = false, .drive_keys = "objects: { 605Dh: { access: none } }"};
}

/// Under way at 100 mm/s, which is 10 r/s, in the drive's velocity mode.
void run_fast(ModelRig& rig, const MotionValues& with) {
  EXPECT_EQ(rig.complete(EnableRequest{}).state, CommandState::done);
  EXPECT_EQ(rig.complete(SetPositionRequest{.position = 0}).state, CommandState::done);
  ASSERT_TRUE(rig.try_submit(MoveVelocityRequest{.velocity = 100, .with = with}));
  rig.run(2500ms);
  ASSERT_TRUE(rig.moving());
}

void expect_rest(ModelRig& rig, const Command& stop) {
  EXPECT_EQ(stop.state, CommandState::done) << describe(stop);
  EXPECT_FALSE(rig.moving());
  EXPECT_EQ(rig.state()->state, AxisState::standstill);
}

TEST(M13, ADriveThatHaltsInOneWayIsGivenTheRampOfItsMotion) {
  ModelRig rig(halting_in_one_way());
  run_fast(rig, {.acceleration_time = 500ms, .deceleration_time = 2s});
  const auto before = rig.load_mm();
  const auto stop = rig.complete(StopRequest{.kind = StopKind::quick_stop});
  expect_rest(rig, stop);
  EXPECT_EQ(stop.granted.deceleration_time, std::optional<Duration>(2s));
  EXPECT_NEAR(rig.load_mm() - before, 100, 3) << "100 mm/s to 0 in 2 s";
  EXPECT_EQ(rig.drive->peek(halt_option) & 0xFFU, 1U) << "it was told to halt in another way";
}

TEST(M13, ARampOfAQuickStopIsReadAtBringUp) {
  ModelRig rig({.model = "cia402", .limits = false});
  rig.drive->poke(quick_stop_ramp, 10'000);  // 10 r/s in 1 s
  rig.stop_daemon();
  rig.start_daemon();
  run_fast(rig, {.acceleration_time = 100ms, .deceleration_time = 2s});
  const auto before = rig.load_mm();
  const auto stop = rig.complete(StopRequest{.kind = StopKind::quick_stop});
  expect_rest(rig, stop);
  EXPECT_EQ(stop.granted.deceleration_time, std::optional<Duration>(1s));
  EXPECT_NEAR(rig.load_mm() - before, 50, 3);
}

/// Nothing was moved yet, so the ramps that a halt brakes on are those of bring-up.
TEST(M13, AStopEndsTheFirstHomingWithoutEscalation) {
  ModelRig rig({.model = "cia402", .switches = {{"homing_goes_on_without_start_bit", true}}});
  EXPECT_EQ(rig.complete(EnableRequest{}).state, CommandState::done);
  ASSERT_TRUE(rig.try_submit(HomeRequest{}));
  rig.run(800ms);
  ASSERT_TRUE(rig.moving());
  expect_rest(rig, rig.complete(StopRequest{.kind = StopKind::stop}));
  EXPECT_EQ(rig.drive->peek(halt_option) & 0xFFU, 1U) << "it took a quick stop";
}

/// A quick stop is never softer than a stop, and neither is what a stop escalates to.
TEST(M13, ASofterRampThanThatOfTheMotionIsNotChosen) {
  ModelRig rig({.model = "cia402", .limits = false});
  rig.drive->poke(quick_stop_ramp, 1);  // as templates have it: it would brake for hours
  rig.stop_daemon();
  rig.start_daemon();
  run_fast(rig, {.acceleration_time = 500ms, .deceleration_time = 1s});
  const auto before = rig.load_mm();
  const auto stop = rig.complete(StopRequest{.kind = StopKind::quick_stop});
  expect_rest(rig, stop);
  EXPECT_EQ(stop.granted.deceleration_time, std::optional<Duration>(1s));
  EXPECT_NEAR(rig.load_mm() - before, 50, 3);
}

/// 605Dh chooses how it halts, whatever is known of 6085h.
TEST(M13, WithoutAKnownRampAQuickStopIsChosenAllTheSame) {
  ModelRig rig({.model = "cia402", .limits = false, .drive_keys = "objects: { 6085h: { access: none } }"});
  run_fast(rig, {.acceleration_time = 500ms, .deceleration_time = 2s});
  expect_rest(rig, rig.complete(StopRequest{.kind = StopKind::quick_stop}));
  EXPECT_EQ(rig.drive->peek(halt_option) & 0xFFU, 2U);
  expect_rest(rig, rig.complete(StopRequest{.kind = StopKind::stop}));
  EXPECT_EQ(rig.drive->peek(halt_option) & 0xFFU, 1U);
}

/// Nothing of that keeps a drive that does not stop from being found out.
TEST(M13, ADriveThatHaltsInOneWayAndDoesNotStopEndsInAnError) {
  ModelRig rig(halting_in_one_way());
  run_fast(rig, {.acceleration_time = 500ms});
  rig.drive->poke(deceleration, 1);  // it would brake for hours
  const auto from = rig.world.now();
  const auto stop = rig.complete(StopRequest{.kind = StopKind::quick_stop});
  EXPECT_EQ(stop.state, CommandState::error) << describe(stop);
  ASSERT_TRUE(stop.cause);
  EXPECT_EQ(stop.cause->reason, Reason::not_confirmed);
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  EXPECT_LT(rig.world.now() - from, 1500ms);
}

}  // namespace
}  // namespace axisd::test
