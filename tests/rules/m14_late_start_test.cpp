// A drive that begins some time after it has acknowledged a start, and ignores what stops it before (M13,
// M14).
#include <gtest/gtest.h>

#include <vector>

#include "tests/rules/late_start_rig.hpp"
#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

/// Every so often a stop may come between a start's acknowledgement and 150 ms later.
const std::vector<Duration> after_start{0ms, 1ms, 5ms, 15ms, 40ms, 70ms, 79ms, 81ms, 90ms, 150ms};

TEST(M14, AStopIsNotDoneBeforeTheMotionThatItStopsCannotBeginAnyMore) {
  for (const Action& motion : std::vector<Action>{MoveAbsoluteRequest{.position = 300}, HomeRequest{},
                                                  MoveVelocityRequest{.velocity = 50}})
    for (const auto kind : {StopKind::halt, StopKind::stop})
      for (const auto delay : after_start) {
        SCOPED_TRACE(testing::Message()
                     << to_string(kind_of(motion)) << ", " << delay.count() / 1e6 << " ms");
        Rig rig(late());
        rig.ready();
        const auto command = rig.submit(motion);
        ASSERT_TRUE(rig.run_until([&] { return command->value().state == CommandState::active; }, 1s));
        rig.run(delay);
        const auto stop = rig.complete(StopRequest{.kind = kind});
        EXPECT_EQ(stop.state, CommandState::done) << describe(stop);
        rig.drive->advance(rig.world.now());
        EXPECT_FALSE(rig.drive->shaft_moving()) << "told at rest";
        const auto where = rig.drive->shaft_pulses();
        rig.run(3s);
        EXPECT_EQ(rig.drive->shaft_pulses(), where) << "it has moved after its stop was done";
        EXPECT_EQ(rig.state()->state, AxisState::standstill);
      }
}

/// The shaft of a closed loop still comes to rest when the next motion is started: that it is elsewhere than
/// then is no sign that this one has begun, and ended.
TEST(M14, AShaftThatSettlesIsNotTakenForAMotionThatHasBegunAndEnded) {
  on_each_measured_late([](const RigOptions& options) {
    for (const auto delay : {0ms, 5ms, 15ms, 40ms}) {
      SCOPED_TRACE(testing::Message() << "replaced, then stopped after " << delay.count() << " ms");
      Rig rig(options);
      rig.ready();
      rig.submit(MoveAbsoluteRequest{.position = 300});
      rig.run(1500ms);
      const auto back = rig.submit(MoveAbsoluteRequest{.position = 20});
      ASSERT_TRUE(rig.run_until([&] { return back->value().state == CommandState::active; }, 5s));
      rig.run(delay);
      const auto stop = rig.complete(StopRequest{});
      EXPECT_EQ(stop.state, CommandState::done) << describe(stop);
      EXPECT_FALSE(is_driven(rig, 700ms)) << "told at rest";
    }
    for (const auto delay : {10ms, 30ms, 50ms, 110ms}) {
      SCOPED_TRACE(testing::Message() << "halted, moved, then stopped after " << delay.count() << " ms");
      Rig rig(options);
      rig.ready();
      rig.submit(MoveAbsoluteRequest{.position = 300});
      rig.run(900ms);
      ASSERT_EQ(rig.complete(StopRequest{.kind = StopKind::halt}).state, CommandState::done);
      rig.submit(MoveAbsoluteRequest{.position = 10});
      rig.run(delay);
      const auto stop = rig.complete(StopRequest{});
      EXPECT_EQ(stop.state, CommandState::done) << describe(stop);
      EXPECT_FALSE(is_driven(rig, 700ms)) << "told at rest";
    }
  });
}

TEST(M9, OnAMeasuredShaftThatSettlesOnlyTheLastOfThreeMotionsIsExecutedToItsEnd) {
  on_each_measured_late([](const RigOptions& options) {
    for (const auto delay : {0ms, 15ms, 70ms, 90ms}) {
      SCOPED_TRACE(testing::Message() << delay.count() << " ms");
      Rig rig(options);
      rig.ready();
      rig.submit(MoveAbsoluteRequest{.position = 300});
      rig.run(1500ms);
      const auto back = rig.submit(MoveAbsoluteRequest{.position = 20});
      ASSERT_TRUE(rig.run_until([&] { return back->value().state == CommandState::active; }, 5s));
      rig.run(delay);
      const auto last = rig.complete(MoveAbsoluteRequest{.position = 200});
      EXPECT_EQ(last.state, CommandState::done) << describe(last);
      EXPECT_NEAR(rig.state()->position, 200, 0.03);
      EXPECT_FALSE(is_driven(rig, 700ms)) << "told at rest";
    }
  });
}

/// Nor for a start that the drive has never seen: nobody may be told that it was executed.
TEST(M8, AShaftThatSettlesDoesNotShowThatALostStartWasExecuted) {
  on_each_measured_late([](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(1500ms);
    rig.fault({.kind = FaultKind::drop_request, .function = 0x06, .register_address = 0x0027});
    const auto back = rig.submit(MoveAbsoluteRequest{.position = 20});
    ASSERT_TRUE(rig.run_until([&] { return back->has_ended(); }, 10s));
    EXPECT_EQ(back->value().state, CommandState::error) << describe(back->value());
    EXPECT_EQ(rig.axis().unknown_starts().executed, 0U);
    EXPECT_FALSE(is_driven(rig, 700ms));
  });
}

/// By CiA 402: after a stop a drive without a word of its own moves until it has shown its rest. That is no
/// sign that a start has begun, of which nobody knows whether it arrived.
TEST(M14, ADoubtAboutRestIsNotTakenForAMotionThatHasBegun) {
  for (const auto delay : {5ms, 20ms, 60ms}) {
    SCOPED_TRACE(testing::Message() << delay.count() << " ms");
    CanRig rig({.model = "cia402"});
    rig.ready();
    rig.done(MoveAbsoluteRequest{.position = 30});
    rig.nodes().add_fault({.kind = FaultKind::drop_request, .object = 0x6040});
    rig.submit(MoveAbsoluteRequest{.position = 300});
    ASSERT_TRUE(rig.run_until([&] { return rig.nodes().pending_faults() == 0; }, 1s));
    rig.run(delay);
    const auto asked = rig.world.now();
    const auto stop = rig.complete(StopRequest{});
    EXPECT_EQ(stop.state, CommandState::done) << describe(stop);
    EXPECT_GE(rig.world.now() - asked, start_window);
  }
}

TEST(M9, AMotionThatIsReplacedBeforeItBeginsIsNotExecutedInItsPlace) {
  for (const auto delay : after_start) {
    SCOPED_TRACE(testing::Message() << delay.count() / 1e6 << " ms");
    Rig rig(late());
    rig.ready();
    ASSERT_EQ(rig.complete(MoveAbsoluteRequest{.position = 100}).state, CommandState::done);
    const auto first = rig.submit(MoveAbsoluteRequest{.position = 300});
    ASSERT_TRUE(rig.run_until([&] { return first->value().state == CommandState::active; }, 1s));
    rig.run(delay);
    const auto second = rig.complete(MoveAbsoluteRequest{.position = 80});
    EXPECT_EQ(second.state, CommandState::done) << describe(second);
    EXPECT_EQ(first->value().state, CommandState::aborted);
    EXPECT_NEAR(rig.state()->position, 80, 0.01);
  }
}

/// The stop that is owed is the first that the drive gets then; but it had not begun yet.
TEST(M4, AMotionThatBeginsUnderTheStopOfAReconnectIsStoppedAgain) {
  Rig rig(late());
  rig.ready();
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 300, .with = {.velocity = 50}});
  ASSERT_TRUE(rig.run_until([&] { return move->value().state == CommandState::active; }, 1s));
  rig.line->forget_wire();
  rig.line->set_open(false);
  rig.run(1ms);
  const auto stop = rig.submit(StopRequest{});
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 30ms));
  rig.line->set_open(true);
  rig.reconnect();
  EXPECT_NE(stop->value().state, CommandState::done) << describe(stop->value());
  EXPECT_FALSE(rig.drive->shaft_moving());
  const auto where = rig.drive->shaft_pulses();
  rig.run(2s);
  EXPECT_EQ(rig.drive->shaft_pulses(), where);
  int stops = 0;
  for (const auto& entry : rig.line->wire())
    if (entry.is_write() && entry.address() == 0x0028) {
      EXPECT_EQ(entry.value(), 0) << "no quick stop: it would cost the position";
      ++stops;
    }
  EXPECT_GE(stops, 2);
}

TEST(M10, AMotionThatGoesTheWrongWayIsStopped) {
  Rig rig;
  rig.ready();
  ASSERT_EQ(rig.complete(MoveAbsoluteRequest{.position = 100}).state, CommandState::done);
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 300, .with = {.velocity = 50}});
  rig.run(500ms);
  const auto where = rig.state()->position;
  // As if the drive executed another motion than this one.
  rig.write_behind(0x0028, 0);
  ASSERT_TRUE(rig.run_until([&] { return !rig.drive->shaft_moving(); }, 2s));
  rig.write_behind(0x0024, 0xFFFF);
  rig.write_behind(0x0025, 0x8000);
  rig.write_behind(0x0027, 1);
  ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 5s));
  EXPECT_EQ(move->value().state, CommandState::error) << describe(move->value());
  rig.run(2s);
  EXPECT_FALSE(rig.drive->shaft_moving());
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  EXPECT_GT(rig.state()->position, where - 60) << "stopped soon behind its start";
}

TEST(M10, AMotionThatGoesBeyondItsTargetIsStopped) {
  Rig rig({.switches = {{"start_in_motion", true}}});
  rig.ready();
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 300, .with = {.velocity = 50}});
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->position > 290; }, 10s));
  // As if the drive executed another motion than this one: to 450 mm. The canary does not show it so soon.
  rig.write_behind(0x0024, 0);
  rig.write_behind(0x0025, 45'000);
  rig.write_behind(0x0027, 5);
  ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 20s));
  EXPECT_EQ(move->value().state, CommandState::error) << describe(move->value());
  rig.run(2s);
  EXPECT_FALSE(rig.drive->shaft_moving());
  EXPECT_GT(rig.state()->position, 301);
  EXPECT_LT(rig.state()->position, 320) << "stopped soon behind its target";
}

/// What is acknowledged may be looked after; what is not goes out again as long as the motor turns (M4).
TEST(M13, WhileTheMotorTurnsStopsGoOutUntilOneIsAcknowledged) {
  Rig rig;
  rig.ready();
  rig.submit(MoveVelocityRequest{.velocity = 80});
  rig.run(1s);
  rig.fault({.kind = FaultKind::drop_request, .function = 0x06, .count = 6});
  const auto asked = rig.world.now();
  const auto stop = rig.submit(StopRequest{});
  ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 5s));
  EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
  EXPECT_EQ(rig.state()->trust, PositionTrust::set) << "no quick stop was needed";
  TimePoint last = asked;
  int frames = 0;
  for (const auto& entry : rig.line->wire()) {
    if (!entry.is_write() || entry.address() != 0x0028) continue;
    EXPECT_LT(entry.begin - last, 60ms) << "stop frame " << frames;
    last = entry.begin;
    ++frames;
  }
  EXPECT_EQ(frames, 7);
}

}  // namespace
}  // namespace axisd::test
