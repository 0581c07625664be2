// CANopen: power and the end of a halt never move; SYNC, NMT, and nodes that boot or fall silent.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// What a drive may do with what is left of an earlier motion.
const std::vector<std::vector<const char*>> leftovers = {
    {"halt_release_resumes"},        {"halt_release_restarts_velocity"},
    {"velocity_cleared_on_disable"}, {"mode_change_keeps_setpoint"},
    {"start_of_enabled_edge"},       {"bit6_always"},
    {"setpoint_in_motion_ignored"},  {"release_keeps_state"},
    {"disable_operation_cuts"},
};

/// A motion under way, then stopped by `kind`.
void move_and_stop(CanRig& rig, const Action& motion, StopKind kind) {
  const auto command = rig.submit(motion);
  rig.run(700ms);
  ASSERT_TRUE(rig.state()->moving) << describe(command->value());
  rig.done(StopRequest{.kind = kind});
  EXPECT_FALSE(rig.drive->shaft_moving());
}

/// Nothing of what comes turns the shaft.
void expect_still(CanRig& rig, const std::function<void()>& what) {
  const auto before = rig.shaft();
  const auto starts = rig.drive->starts();
  what();
  rig.run(300ms);
  EXPECT_EQ(rig.shaft(), before);
  EXPECT_EQ(rig.drive->starts(), starts);
}

TEST(M23, AfterAHaltNothingResumes) {
  for_each_reading({}, leftovers, [](const CanRigOptions& options) {
    for (const auto kind : {StopKind::halt, StopKind::stop, StopKind::quick_stop}) {
      CanRig rig(options);
      rig.ready();
      move_and_stop(rig, MoveAbsoluteRequest{.position = 300}, kind);
      expect_still(rig, [&] {
        rig.done(DisableRequest{});
        rig.done(EnableRequest{});
      });
      rig.done(EnableRequest{});
      // Backwards: had the old set-point been resumed, it would show.
      move_and_stop(rig, MoveAbsoluteRequest{.position = 290}, kind);
      const auto at = rig.shaft();
      const auto back = rig.complete(MoveAbsoluteRequest{.position = 1});
      EXPECT_EQ(back.state, CommandState::done) << describe(back);
      EXPECT_LT(rig.shaft(), at);
      EXPECT_NEAR(static_cast<double>(rig.shaft()), 100, 1);
    }
  });
}

TEST(M23, AVelocityLeftOverNeverTurnsTheShaft) {
  auto base = CanRigOptions{.limits = false};
  for_each_reading(base, leftovers, [](const CanRigOptions& options) {
    CanRig rig(options);
    rig.ready();
    move_and_stop(rig, MoveVelocityRequest{.velocity = 50}, StopKind::stop);
    // As an earlier run of the daemon, or another master, may leave it.
    rig.touch([](auto& node) { node.poke(0x60FF00, 400); });
    expect_still(rig, [&] { rig.done(EnableRequest{}); });
    rig.touch([](auto& node) { node.poke(0x60FF00, 400); });
    rig.done(DisableRequest{});
    rig.touch([](auto& node) { node.poke(0x60FF00, 400); });
    expect_still(rig, [&] { rig.done(EnableRequest{}); });
    const auto at = rig.shaft();
    move_and_stop(rig, MoveVelocityRequest{.velocity = -20}, StopKind::halt);
    EXPECT_LT(rig.shaft(), at);
  });
}

TEST(M23, AfterAFaultNothingGoesOn) {
  auto base = CanRigOptions{.limits = false};
  for_each_reading(base, leftovers, [](const CanRigOptions& options) {
    for (const bool velocity : {true, false}) {
      CanRig rig(options);
      rig.ready();
      const Action motion = velocity ? Action(MoveVelocityRequest{.velocity = 50})
                                     : Action(MoveRelativeRequest{.distance = 200});
      const auto command = rig.submit(motion);
      rig.run(600ms);
      rig.touch([](auto& node) { node.raise_alarm(4); });
      rig.run(500ms);
      EXPECT_EQ(rig.state()->state, AxisState::error_stop);
      EXPECT_EQ(rig.state()->alarm_code, 4);
      EXPECT_TRUE(command->has_ended());
      expect_still(rig, [&] {
        rig.done(ResetRequest{});
        rig.done(EnableRequest{});
      });
    }
  });
}

TEST(M23, AfterACutCableTheFirstFrameIsAStop) {
  auto base = CanRigOptions{.limits = false};
  for_each_reading(base, {{"halt_release_resumes"}}, [](const CanRigOptions& options) {
    CanRig rig(options);
    rig.ready();
    (void)rig.submit(MoveVelocityRequest{.velocity = 50});
    rig.run(600ms);
    rig.nodes().set_connected(false);
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 3s));
    EXPECT_TRUE(rig.drive->shaft_moving()) << "the drive notices nothing (M16)";
    rig.nodes().set_connected(true);
    rig.reconnect();
    rig.run(500ms);
    EXPECT_FALSE(rig.drive->shaft_moving());
    expect_still(rig, [&] {
      rig.done(ResetRequest{});
      rig.done(EnableRequest{});
    });
  });
}

TEST(M23, AnEarlierRunsMotionIsStoppedAndNotResumed) {
  for (const bool velocity : {true, false}) {
    CanRig rig({.limits = false});
    rig.ready();
    (void)rig.submit(velocity ? Action(MoveVelocityRequest{.velocity = 50})
                              : Action(MoveRelativeRequest{.distance = 400}));
    rig.run(600ms);
    rig.stop_daemon();
    EXPECT_TRUE(rig.drive->shaft_moving());
    rig.start_daemon();
    rig.run(500ms);
    EXPECT_FALSE(rig.drive->shaft_moving());
    EXPECT_EQ(rig.state()->state, AxisState::standstill) << "M1: it stays energised";
    expect_still(rig, [&] { rig.done(EnableRequest{}); });
    // M25: adopted, not reset.
    for (const auto& [at, frame] : rig.frames)
      if (frame.id == 0) EXPECT_EQ(frame.data[0], 0x01) << can::to_string(frame);
  }
}

TEST(M23, VelocityIsWrittenLastAndPowerComesInPositionMode) {
  CanRig rig({.limits = false});
  rig.ready();
  rig.frames.clear();
  rig.done(DisableRequest{});
  rig.done(EnableRequest{});
  for (const auto word : rig.writes_of(0x604000)) EXPECT_NE(word & 0x0006U, 0x0002U) << "bit 2 (M12)";
  EXPECT_EQ(rig.writes_of(0x604000).back(), 0x000FU);
  EXPECT_EQ(rig.writes_of(0x606000).back(), 1U);
  rig.frames.clear();
  move_and_stop(rig, MoveVelocityRequest{.velocity = 50}, StopKind::stop);
  EXPECT_EQ(rig.writes_of(0x60FF00).back(), 0U);
  EXPECT_EQ(rig.writes_of(0x604000).back(), 0x010FU);
  EXPECT_EQ(rig.writes_of(0x606000).back(), 3U);
}

TEST(M12, StopsInEachMode) {
  for_each_reading({.limits = false}, {{"pdo_parameters_read_only"}}, [](const CanRigOptions& options) {
    for (const auto kind : {StopKind::stop, StopKind::quick_stop}) {
      CanRig rig(options);
      rig.ready();
      move_and_stop(rig, MoveVelocityRequest{.velocity = 50}, kind);
      EXPECT_EQ(rig.drive->peek(0x60FF00), 0U);
      EXPECT_EQ(rig.drive->peek(0x605D00), kind == StopKind::quick_stop ? 1U : 0U);
      move_and_stop(rig, MoveRelativeRequest{.distance = 300}, kind);
      EXPECT_EQ(rig.drive->peek(0x604000), 0x010FU);
      const auto homing = rig.submit(HomeRequest{});
      rig.run(500ms);
      ASSERT_TRUE(rig.state()->moving);
      rig.done(StopRequest{.kind = kind});
      EXPECT_EQ(homing->value().state, CommandState::aborted);
      EXPECT_FALSE(rig.drive->shaft_moving());
      EXPECT_TRUE(rig.state()->enabled);
      expect_still(rig, [&] { rig.done(EnableRequest{}); });
    }
  });
}

TEST(M21, HomesWithWhicheverCodesAndBitsTheDriveHas) {
  const std::vector<std::vector<const char*>> readings = {{"homing_codes_cia", "homing_codes_0_to_3"},
                                                          {"homed_only_bit8"},
                                                          {"homed_only_bit12"},
                                                          {"bit13_is_homing_error"},
                                                          {"bit11_is_limit"},
                                                          {"homed_stays_during_homing"},
                                                          {"homing_29_ends_backwards"},
                                                          {"start_speed_u32"},
                                                          {"motion_objects_u16"},
                                                          {"homing_goes_on_after_start_bit"},
                                                          {"segmented_uploads"},
                                                          {"pdo_parameters_read_only"}};
  for_each_reading({}, readings, [](const CanRigOptions& options) {
    CanRig rig(options);
    rig.done(EnableRequest{});
    for (int time = 0; time < 2; ++time) {
      rig.done(HomeRequest{});
      EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
      rig.run(300ms);
      EXPECT_TRUE(rig.state()->homed);
      EXPECT_TRUE(rig.state()->enabled);
      rig.done(MoveAbsoluteRequest{.position = 7.5});
    }
  });
}

/// 6.2.2 and the appendix read bit 13 differently: with the key of the second the drive is enabled, moves and
/// homes in both.
TEST(M23, WithBit13InTheReadingOfTheAppendixTheStateTells) {
  for_each_reading(
      {.adjust =
           [](AxisSettings& axis) { axis.model_settings["status_bit_13"] = std::string("homing_error"); }},
      {{"bit13_is_homing_error"}, {"bit13_not_enabled"}}, [](const CanRigOptions& options) {
        const auto& flipped = options.switches;
        CanRig rig(options);
        EXPECT_EQ(rig.state()->state, AxisState::disabled);
        rig.done(EnableRequest{});
        EXPECT_TRUE(rig.state()->enabled);
        if (flipped.empty()) return;  // there bit 13 is 1 in homing: that it failed
        rig.done(HomeRequest{});
        EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
        rig.done(MoveAbsoluteRequest{.position = 5});
        rig.done(DisableRequest{});
        EXPECT_FALSE(rig.state()->enabled);
      });
}

/// Without the key such a drive never shows that it is enabled.
TEST(M23, WithBit13InTheReadingOfTheManualItIsThePowerStage) {
  CanRig rig({.switches = {{"bit13_not_enabled", true}}});
  const auto enabled = rig.complete(EnableRequest{});
  EXPECT_EQ(enabled.state, CommandState::error);
  ASSERT_TRUE(enabled.cause);
  EXPECT_EQ(enabled.cause->reason, Reason::not_confirmed) << to_string(*enabled.cause);
}

TEST(M24, StateComesByPdoAndElseBySdo) {
  for (const Duration period : {Duration(0ms), Duration(10ms)}) {
    CanRig rig({.sync_period = period});
    EXPECT_EQ(rig.state()->link_note, "");
    rig.ready();
    rig.frames.clear();
    rig.run(1s);
    EXPECT_GT(rig.count_of(0x180 + CanRig::node_id), 10);
    EXPECT_GT(rig.count_of(0x280 + CanRig::node_id), 10);
    EXPECT_EQ(rig.count_of(0x80) > 0, period > 0ms);
    EXPECT_LT(rig.count_of(0x600 + CanRig::node_id), 30) << "canary and drift only";
    rig.done(MoveAbsoluteRequest{.position = 30});
  }
}

TEST(M24, WhereTheDriveRefusesPdosItIsPolledAndSaysSo) {
  CanRig rig({.connect = false});
  rig.nodes().add_fault(
      {.kind = simulation::FaultKind::abort, .count = -1, .object = 0x1A00, .code = 0x06010002});
  rig.reconnect();
  EXPECT_THAT(rig.state()->link_note, testing::StartsWith("state by SDO polling: TPDO 1: "));
  rig.ready();
  rig.done(MoveAbsoluteRequest{.position = 30});
}

TEST(M24, PdosThatDoNotComeAreMissedAndUsedWhenTheyComeAgain) {
  for (const Duration period : {Duration(0ms), Duration(10ms)}) {
    CanRig rig({.sync_period = period});
    rig.ready();
    rig.network.set_fault([](const can::Frame& frame) {
      return can::Network::Fault{.drop = frame.id == 0x280U + CanRig::node_id};
    });
    rig.run(2s);
    EXPECT_EQ(rig.state()->link_note, "state by SDO polling: its TPDOs do not come");
    EXPECT_EQ(rig.state()->link, LinkState::online);
    rig.done(MoveAbsoluteRequest{.position = 30});
    rig.network.set_fault({});
    rig.run(2s);
    EXPECT_EQ(rig.state()->link_note, "");
  }
}

TEST(M08, ATriggerWithoutReplyIsNeverSentAgain) {
  for (const bool executed : {true, false}) {
    CanRig rig;
    rig.ready();
    rig.frames.clear();
    rig.nodes().add_fault(
        {.kind = executed ? simulation::FaultKind::drop_reply : simulation::FaultKind::drop_request,
         .object = 0x6040});
    const auto moved = rig.complete(MoveAbsoluteRequest{.position = 30});
    const auto words = rig.writes_of(0x604000);
    EXPECT_EQ(std::ranges::count(words, 0x001FU), 1) << "M8";
    EXPECT_EQ(moved.state, executed ? CommandState::done : CommandState::error) << describe(moved);
    rig.run(1s);
    rig.done(MoveAbsoluteRequest{.position = 10});
    EXPECT_NEAR(static_cast<double>(rig.shaft()), 1000, 1);
  }
}

TEST(M07, ARebootThatNobodyHeardIsFoundByTheCanary) {
  CanRig rig;
  rig.ready();
  rig.done(MoveAbsoluteRequest{.position = 30});
  rig.network.set_fault([](const can::Frame& frame) {
    return can::Network::Fault{.drop = frame.id == 0x700U + CanRig::node_id};
  });
  rig.cycle_power(1ms);
  rig.run(1s);
  rig.network.set_fault({});
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 3s));
  rig.reconnect();
  EXPECT_FALSE(rig.state()->enabled);
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
}

TEST(M24, TheEmergencyIdentifierIsSetBeforeTheFirstSync) {
  CanRig rig({.switches = {{"emergency_cob_is_sync", true}}, .sync_period = 10ms});
  rig.run(100ms);
  EXPECT_EQ(rig.drive->peek(0x101400), 0x80U + CanRig::node_id);
  bool set = false;
  for (const auto& [at, frame] : rig.frames) {
    if (frame.id == 0x600U + CanRig::node_id && frame.data[1] == 0x14 && frame.data[2] == 0x10) set = true;
    if (frame.id == 0x80) EXPECT_TRUE(set);
  }
  EXPECT_GT(rig.count_of(0x80), 0);
}

TEST(M25, ARebootInMidMoveIsSeenAtOnceAndNothingMovesAfterIt) {
  CanRig rig;
  rig.ready();
  const auto command = rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(600ms);
  rig.cycle_power(10ms);
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 1s));
  EXPECT_TRUE(command->has_ended());
  EXPECT_EQ(command->value().cause->reason, Reason::rebooted) << describe(command->value());
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  rig.reconnect();
  expect_still(rig, [&] { rig.run(1s); });
  EXPECT_FALSE(rig.state()->enabled);
  EXPECT_EQ(rig.state()->link_note, "");
  rig.ready();
  rig.done(MoveAbsoluteRequest{.position = 5});
}

TEST(M25, ASilentNodeGoesOfflineAndIsAdoptedAgain) {
  CanRig rig;
  rig.ready();
  rig.nodes().set_connected(false);
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 3s));
  rig.nodes().set_connected(true);
  rig.reconnect();
  EXPECT_EQ(rig.state()->reboots, 0);
  EXPECT_TRUE(rig.state()->enabled);
  rig.done(MoveAbsoluteRequest{.position = 5});
}

TEST(M05, AnAlarmThatIsGoneBeforeThePollIsToldByItsEmergency) {
  CanRig rig;
  rig.ready();
  rig.run(100ms);
  rig.touch([](auto& node) { node.raise_alarm(2); });
  rig.run(1ms);
  rig.touch([](auto& node) { node.raise_alarm(0); });
  rig.run(500ms);
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  ASSERT_TRUE(rig.state()->fault);
  EXPECT_EQ(rig.state()->fault->where.native_code, 2U);
}

TEST(M19, TargetsBeyondWhatTheDriveTakes) {
  CanRig rig({.limits = false, .switches_near = false, .adjust = [](AxisSettings& axis) {
                axis.limits.velocity = 400;
              }});
  rig.ready();
  const auto refused = rig.machine->submit("feeder", MoveRelativeRequest{.distance = 10'001}, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::out_of_range);
  ASSERT_TRUE(refused.error().permitted);
  EXPECT_NEAR(refused.error().permitted->maximum, 10'000, 1e-6);
  // 607Ah ends at 1,000,000 pulses: the counter is zeroed in between, and nothing is lost.
  rig.done(MoveRelativeRequest{.distance = 9'000});
  rig.done(MoveRelativeRequest{.distance = 9'000});
  EXPECT_EQ(rig.shaft(), 1'800'000);
  EXPECT_NEAR(rig.state()->position, 18'000, 0.01);
}

}  // namespace
}  // namespace axisd::test
