// Stops on CANopen where the halt bit stands already, where little is known of the drive, and where the node
// is stopped itself.
#include <gtest/gtest.h>

#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t control_rpdo = 0x200;

/// A slow ramp: what a quick stop shortens shows.
void slow_ramps(AxisSettings& axis) {
  axis.limits.acceleration_time = 200ms;
  axis.limits.deceleration_time = 2000ms;
}

void add_jog(AxisSettings& axis) { axis.inputs.push_back({.terminal = "X3", .function = "jog_positive"}); }

/// A halt suspends a move, and then a terminal jogs under that halt.
void halt_and_jog(CanRig& rig) {
  rig.ready();
  (void)rig.submit(MoveRelativeRequest{.distance = 900});
  rig.run(500ms);
  rig.done(StopRequest{.kind = StopKind::stop});
  rig.touch([](auto& node) { node.set_input("X3", true); });
  rig.run(500ms);
  ASSERT_TRUE(rig.drive->shaft_moving());
}

/// Halt words on the wire, by RPDO or SDO.
long halts(const CanRig& rig) {
  const auto sdo = rig.writes_of(0x604000);
  const auto has_halt = [](std::uint32_t word) { return (word & 0x100U) != 0; };
  return std::ranges::count_if(sdo, has_halt) + std::ranges::count_if(rig.frames, [&](const auto& entry) {
           const auto& frame = entry.second;
           return frame.id == control_rpdo + CanRig::node_id && has_halt(frame.data[0] | frame.data[1] << 8U);
         });
}

/// Drops what the drive answers to SDO.
void make_mute(CanRig& rig) {
  rig.network.set_fault([](const can::Frame& frame) {
    return can::Network::Fault{.drop = frame.id == 0x580U + CanRig::node_id};
  });
}

TEST(M12, AQuickStopEndsTheRampOfAStop) {
  for_each_reading({.limits = false, .adjust = slow_ramps},
                   {{"halt_release_resumes"},
                    {"mode_change_keeps_setpoint"},
                    {"pdo_parameters_read_only"},
                    {"halt_release_restarts_velocity"}},
                   [](const CanRigOptions& options) {
                     for (const bool velocity : {true, false}) {
                       CanRig rig(options);
                       rig.ready();
                       (void)rig.submit(velocity ? Action(MoveVelocityRequest{.velocity = 50})
                                                 : Action(MoveRelativeRequest{.distance = 900}));
                       rig.run(1s);
                       ASSERT_TRUE(rig.drive->shaft_moving());
                       (void)rig.submit(StopRequest{.kind = StopKind::stop});
                       rig.run(300ms);
                       ASSERT_TRUE(rig.drive->shaft_moving()) << "the ramp lasts";
                       (void)rig.submit(StopRequest{.kind = StopKind::quick_stop});
                       rig.run(60ms);
                       EXPECT_FALSE(rig.drive->shaft_moving());
                       EXPECT_EQ(rig.drive->peek(0x604000), 0x010FU);
                       rig.run(1s);
                       EXPECT_EQ(rig.state()->state, AxisState::standstill);
                     }
                   });
}

TEST(M12, WhereNoEdgeEndsARampTheStopIsStillConfirmed) {
  CanRig rig({.switches = {{"halt_edge_cuts_ramp", false}}, .limits = false, .adjust = slow_ramps});
  rig.ready();
  (void)rig.submit(MoveRelativeRequest{.distance = 900});
  rig.run(1s);
  (void)rig.submit(StopRequest{.kind = StopKind::stop});
  rig.run(300ms);
  (void)rig.submit(StopRequest{.kind = StopKind::quick_stop});
  rig.run(4s);
  EXPECT_FALSE(rig.drive->shaft_moving());
  EXPECT_EQ(rig.drive->peek(0x604000), 0x010FU);
}

/// A motion that has just begun is slower than the noise of the velocity, and still within that of the
/// position.
TEST(M13, AStopOfWhatHasJustBegunIsDoneAtRest) {
  int crept = 0;
  for (const bool polled : {false, true})
    for (Duration after{}; after < 100ms; after += 3ms) {
      CanRig rig({.model = "cia402", .polled = polled, .limits = false, .adjust = [](AxisSettings& axis) {
                    axis.limits.acceleration_time = 20'000ms;
                    axis.limits.deceleration_time = 20'000ms;
                  }});
      rig.ready();
      (void)rig.submit(MoveRelativeRequest{.distance = 5});
      ASSERT_TRUE(rig.run_until([&] { return rig.drive->shaft_moving(); }, 1s));
      rig.run(after);
      const auto stop = rig.submit(StopRequest{.kind = StopKind::stop});
      crept += rig.drive->shaft_moving() ? 1 : 0;
      ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 30s));
      EXPECT_EQ(stop->value().state, CommandState::done);
      EXPECT_FALSE(rig.drive->shaft_moving()) << after.count();
    }
  EXPECT_GT(crept, 30);
}

TEST(M13, AStopEndsWhatATerminalStartedUnderHalt) {
  for (const auto kind : {StopKind::stop, StopKind::quick_stop}) {
    for_each_reading({.limits = false, .adjust = add_jog},
                     {{"halt_release_resumes"}, {"pdo_parameters_read_only"}, {"mode_change_keeps_setpoint"}},
                     [kind](const CanRigOptions& options) {
                       CanRig rig(options);
                       halt_and_jog(rig);
                       (void)rig.submit(StopRequest{.kind = kind});
                       rig.run(1s);
                       EXPECT_FALSE(rig.drive->shaft_moving());
                       EXPECT_EQ(rig.drive->peek(0x604000), 0x010FU);
                     });
  }
}

/// A stop cuts the reading that is under way: that no answer came shows all the same.
TEST(M7, WhoStopsASilentNodeAgainAndAgainDoesNotKeepItOnline) {
  for (const bool polled : {false, true})
    for (const auto every : {3ms, 20ms}) {
      SCOPED_TRACE(every.count());
      CanRig rig({.polled = polled, .limits = false});
      rig.ready();
      rig.network.set_fault([](const can::Frame&) { return can::Network::Fault{.drop = true}; });
      const auto since = rig.world.now();
      while (rig.state()->link == LinkState::online && rig.world.now() < since + 20s) {
        (void)rig.machine->submit("feeder", StopRequest{}, {.arrived = rig.world.now()});
        rig.run(every);
      }
      EXPECT_EQ(rig.state()->link, LinkState::offline);
      EXPECT_LE(rig.world.now() - since, 6s)
          << "readings have the node between two stops without a reply only";
      ASSERT_TRUE(rig.state()->link_error);
      EXPECT_EQ(rig.state()->link_error->reason, Reason::no_reply) << to_string(*rig.state()->link_error);
    }
}

/// A new edge lets go of the halt for a moment: only in velocity mode nothing is behind it.
TEST(M13, WhereTheModeIsRefusedAStopStartsNothingThatAHaltSuspended) {
  for (const auto object : {0x6060, 0x6061})
    for (const int count : {1, 2, 3, 6, -1}) {
      CanRig rig({.limits = false, .adjust = add_jog});
      halt_and_jog(rig);
      const auto starts = rig.drive->starts();
      rig.nodes().add_fault({.kind = simulation::FaultKind::abort,
                             .count = count,
                             .object = static_cast<std::uint16_t>(object),
                             .code = 0x08000000});
      (void)rig.submit(StopRequest{.kind = StopKind::stop});
      rig.run(5s);
      EXPECT_EQ(rig.drive->starts(), starts) << count;
      if (count > 0) EXPECT_FALSE(rig.drive->shaft_moving()) << count;
    }
}

/// 6.2.2: 07h energises the motor already, and the manual does not say that terminals wait for 0Fh. An enable
/// that failed on its way leaves the drive there.
TEST(M13, AStopEndsWhatATerminalStartedInSwitchedOn) {
  for (const auto* function : {"jog_positive", "homing_start"})
    for (const auto kind : {StopKind::stop, StopKind::quick_stop})
      for_each_reading({.limits = false,
                        .adjust =
                            [function](AxisSettings& axis) {
                              axis.inputs.push_back({.terminal = "X3", .function = function});
                            }},
                       {{"halt_release_resumes"}, {"pdo_parameters_read_only"}},
                       [kind](const CanRigOptions& options) {
                         CanRig rig(options);
                         rig.ready();
                         rig.done(HomeRequest{});
                         rig.done(MoveAbsoluteRequest{.position = 20});
                         rig.done(StopRequest{.kind = StopKind::stop});
                         for (const std::uint8_t halt : {0, 1, 1}) {
                           rig.touch([halt](auto& node) {
                             node.on_frame(can::make_frame(
                                 0x600U + CanRig::node_id,
                                 std::array<std::uint8_t, 8>{0x2B, 0x40, 0x60, 0, 0x07, halt, 0, 0}));
                           });
                           rig.run(500ms);
                           ASSERT_EQ(rig.drive->peek(0x604100) & 0x6FU, 0x23U) << "Switched On";
                           rig.touch([](auto& node) { node.set_input("X3", true); });
                           rig.run(500ms);
                           ASSERT_TRUE(rig.drive->shaft_moving());
                           (void)rig.submit(StopRequest{.kind = kind});
                           rig.run(1s);
                           EXPECT_FALSE(rig.drive->shaft_moving());
                           EXPECT_EQ(rig.drive->peek(0x604000), 0x0107U);
                           rig.touch([](auto& node) { node.set_input("X3", false); });
                           rig.run(1s);
                         }
                       });
}

/// What gives the halt a new edge lets go of it for a moment. Where nobody answers, what a halt suspended may
/// be behind it.
TEST(M13, AStopOfASilentDriveStartsNothingThatAHaltSuspended) {
  for (auto silent = 640ms; silent < 760ms; silent += 6ms) {
    SCOPED_TRACE(silent.count());
    CanRig rig({.limits = false, .adjust = add_jog});
    halt_and_jog(rig);
    rig.nodes().set_connected(false);
    rig.touch([](auto& node) { node.set_input("X3", false); });
    rig.run(150ms);
    ASSERT_FALSE(rig.drive->shaft_moving());
    const auto starts = rig.drive->starts();
    const auto there = rig.shaft();
    (void)rig.submit(StopRequest{.kind = StopKind::stop});
    rig.run(silent);
    rig.nodes().set_connected(true);
    rig.run(3s);
    EXPECT_EQ(rig.drive->starts(), starts);
    EXPECT_EQ(rig.shaft(), there);
  }
}

TEST(M13, AStopNeedsNoAnswer) {
  for (const bool velocity : {true, false}) {
    CanRig rig({.limits = false});
    rig.ready();
    // The reply to the trigger is lost, and nothing is heard by SDO any more.
    const auto command = rig.submit(velocity ? Action(MoveVelocityRequest{.velocity = 50})
                                             : Action(MoveRelativeRequest{.distance = 900}));
    ASSERT_TRUE(rig.run_until([&] { return rig.drive->starts() > 0; }, 2s));
    make_mute(rig);
    rig.run(50ms);
    ASSERT_TRUE(rig.drive->shaft_moving());
    rig.frames.clear();
    (void)rig.submit(StopRequest{.kind = StopKind::stop});
    rig.run(20ms);
    EXPECT_GT(halts(rig), 0);
    rig.run(1s);
    EXPECT_FALSE(rig.drive->shaft_moving());
    rig.network.set_fault({});
  }
}

TEST(M12, AVelocityIsZeroedEvenWhereTheControlWordCannotBeRead) {
  CanRig rig({.limits = false});
  rig.ready();
  (void)rig.submit(MoveVelocityRequest{.velocity = 50});
  rig.run(600ms);
  rig.nodes().set_connected(false);
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 3s));
  rig.run(2s);
  rig.nodes().add_fault({.kind = simulation::FaultKind::drop_reply, .count = -1, .object = 0x6040});
  rig.frames.clear();
  rig.nodes().set_connected(true);
  rig.run(2s);
  EXPECT_FALSE(rig.drive->shaft_moving());
  EXPECT_EQ(rig.drive->peek(0x60FF00), 0U);
  rig.nodes().clear_faults();
}

/// 6.2.2: 07h has energised the motor already.
TEST(M23, AnEnableThatFailsOnItsWayReleasesTheMotorAgain) {
  for (const bool polled : {false, true}) {
    CanRig rig({.polled = polled});
    int dropped = 0;
    rig.network.set_fault([&](const can::Frame& frame) {
      const bool switched_on = (rig.drive->peek(0x604100) & 0x6FU) == 0x23U;
      const bool drop = frame.id == 0x580U + CanRig::node_id && switched_on && dropped < 4;
      dropped += drop ? 1 : 0;
      return can::Network::Fault{.drop = drop};
    });
    const auto enable = rig.complete(EnableRequest{});
    EXPECT_EQ(enable.state, CommandState::error);
    ASSERT_GT(dropped, 0);
    rig.run(1s);
    EXPECT_EQ(rig.drive->peek(0x604100) & 0x2000U, 0U) << "bit 13: energised";
    EXPECT_EQ(rig.state()->state, AxisState::disabled);
    rig.ready();
  }
}

TEST(M01, AStopNeverEnergisesADriveThatSomebodyReleased) {
  CanRig rig({.limits = false});
  rig.ready();
  (void)rig.submit(MoveRelativeRequest{.distance = 900});
  rig.run(600ms);
  rig.nodes().set_connected(false);
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 3s));
  rig.run(2s);
  // As another master does it: Ready To Switch On.
  auto shutdown = can::make_frame(0x600U + CanRig::node_id,
                                  std::array<std::uint8_t, 8>{0x2B, 0x40, 0x60, 0, 0x06, 0, 0, 0});
  rig.touch([&](auto& node) { node.on_frame(shutdown); });
  rig.run(100ms);
  rig.nodes().set_connected(true);
  rig.reconnect();
  rig.run(1s);
  EXPECT_EQ(rig.drive->peek(0x604100) & 0x2000U, 0U) << "bit 13: energised";
  EXPECT_FALSE(rig.state()->enabled);
}

TEST(M04, ANodeStoppedByNmtGetsItsStop) {
  CanRig rig({.limits = false});
  rig.ready();
  (void)rig.submit(MoveVelocityRequest{.velocity = 50});
  rig.run(600ms);
  ASSERT_TRUE(rig.drive->shaft_moving());
  const auto stop = can::make_frame(0, std::array<std::uint8_t, 2>{0x02, CanRig::node_id});
  rig.touch([&](auto& node) { node.on_frame(stop); });
  rig.run(4s);
  EXPECT_FALSE(rig.drive->shaft_moving());
}

TEST(M04, AStopThatFailsWhileTheDriveIsBeingConnectedIsSentBeforeItIsOnline) {
  for (auto phase = 0ms; phase < 1s; phase += 25ms) {
    CanRig rig({.limits = false, .connect = false});
    make_mute(rig);
    rig.run(1s + phase);
    const auto stop = rig.submit(StopRequest{.kind = StopKind::stop});
    ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 5s));
    EXPECT_NE(stop->value().state, CommandState::done);
    rig.frames.clear();
    rig.network.set_fault({});
    rig.reconnect();
    EXPECT_GT(halts(rig), 0) << phase.count() << " ms";
  }
}

TEST(M04, AStopThatTheLinkKeptBackIsSentBeforeTheDriveIsOnlineAgain) {
  int failed = 0;
  for (const bool polled : {false, true}) {
    for (auto phase = 0ms; phase < 40ms; ++phase) {
      CanRig rig({.polled = polled});
      rig.ready();
      rig.run(phase);
      rig.network.set_stalled(true);
      rig.run(phase / 2);
      rig.frames.clear();
      const auto stop = rig.submit(StopRequest{.kind = StopKind::stop});
      ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 10s));
      rig.network.set_stalled(false);
      if (stop->value().state == CommandState::done) continue;
      ++failed;
      rig.run(1s);
      rig.reconnect();
      EXPECT_GT(halts(rig), 0) << phase.count() << " ms, polled " << polled;
    }
  }
  EXPECT_GT(failed, 0);
}

TEST(M04, SoIsOneThatFailsWhileAllElseIsAnswered) {
  int failed = 0;
  for (auto phase = 0ms; phase < 120ms; phase += 3ms) {
    CanRig rig({.limits = false, .connect = false});
    rig.run(phase);
    rig.network.set_fault([](const can::Frame& frame) {
      const bool of_control_word = frame.data[1] == 0x40 && frame.data[2] == 0x60;
      return can::Network::Fault{.drop = frame.id == 0x580U + CanRig::node_id && of_control_word};
    });
    const auto stop = rig.submit(StopRequest{.kind = StopKind::stop});
    ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 5s));
    rig.frames.clear();
    rig.network.set_fault({});
    if (stop->value().state == CommandState::done) continue;  // it came by PDO
    ++failed;
    rig.reconnect();
    rig.run(100ms);
    EXPECT_GT(halts(rig), 0) << phase.count() << " ms";
  }
  EXPECT_GT(failed, 0);
}

TEST(M23, ALostReplyAfterTheEndOfAHaltLeavesTheDriveWatched) {
  // Each reply of the chain in turn.
  for (int lost = 1; lost <= 40; lost += 3) {
    SCOPED_TRACE(lost);
    CanRig rig({.limits = false});
    rig.ready();
    (void)rig.submit(MoveRelativeRequest{.distance = 900});
    rig.run(500ms);
    rig.done(StopRequest{.kind = StopKind::stop});
    int replies = 0;
    rig.network.set_fault([&replies, lost](const can::Frame& frame) {
      if (frame.id != 0x580U + CanRig::node_id) return can::Network::Fault{};
      ++replies;
      return can::Network::Fault{.drop = replies == lost || replies == lost + 1};
    });
    const auto before = rig.shaft();
    (void)rig.submit(EnableRequest{});
    rig.run(2s);
    EXPECT_EQ(rig.shaft(), before);
    rig.network.set_fault({});
    rig.run(1s);
    const auto moved = rig.complete(MoveRelativeRequest{.distance = -2});
    EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
    EXPECT_NEAR(static_cast<double>(rig.shaft()), static_cast<double>(before - 200), 1);
  }
}

TEST(M08, EnablingSurvivesALostReply) {
  for (const auto fault : {simulation::FaultKind::drop_reply, simulation::FaultKind::drop_request}) {
    for (int which = 1; which <= 4; ++which) {
      SCOPED_TRACE(which);
      CanRig rig({.limits = false});
      int words = 0;
      rig.network.set_fault([&words, which, fault](const can::Frame& frame) {
        const bool word =
            frame.id == (fault == simulation::FaultKind::drop_reply ? 0x580U : 0x600U) + CanRig::node_id &&
            frame.data[1] == 0x40 && frame.data[2] == 0x60 &&
            (frame.data[0] == 0x60 || (frame.data[0] & 0xE0U) == 0x20U);
        return can::Network::Fault{.drop = word && ++words == which};
      });
      const auto enabled = rig.complete(EnableRequest{});
      rig.network.set_fault({});
      EXPECT_EQ(enabled.state, CommandState::done) << describe(enabled);
      EXPECT_EQ(rig.drive->peek(0x604100) & 0x6FU, 0x27U) << "Operation Enabled";
      rig.done(SetPositionRequest{.position = 0});
      rig.done(MoveAbsoluteRequest{.position = 3});
    }
  }
}

/// What is said before the halt is there, though its reply is lost.
TEST(M12, AHaltDoesNotWaitForALostReply) {
  for (const auto kind : {StopKind::stop, StopKind::quick_stop}) {
    CanRig rig;
    rig.ready();
    (void)rig.submit(MoveRelativeRequest{.distance = 200});
    rig.run(500ms);
    ASSERT_TRUE(rig.drive->shaft_moving());
    for (const std::uint16_t object : {0x605D, 0x60FF})
      rig.nodes().add_fault({.kind = simulation::FaultKind::drop_reply, .count = -1, .object = object});
    rig.frames.clear();
    const auto from = rig.world.now();
    (void)rig.submit(StopRequest{.kind = kind});
    ASSERT_TRUE(rig.run_until([&] { return !rig.writes_of(0x604000).empty(); }, 1s));
    EXPECT_LE(rig.world.now() - from, 50ms) << static_cast<int>(kind);
    rig.nodes().clear_faults();
    rig.run(3s);
    EXPECT_FALSE(rig.drive->shaft_moving());
  }
}

/// After a power-up that only the canary saw an RPDO may be anything, also one that waits for a SYNC.
TEST(M24, NoStopByAPdoThatAPowerUpMayHaveChanged) {
  CanRig rig({.adjust = [](AxisSettings& axis) { axis.poll_idle = 5s; }});
  rig.ready();
  rig.frames.clear();
  (void)rig.complete(StopRequest{});
  ASSERT_GT(rig.count_of(control_rpdo + CanRig::node_id), 0) << "stops go by RPDO 1";
  rig.network.set_fault([](const can::Frame& frame) {
    return can::Network::Fault{.drop = frame.id == 0x700U + CanRig::node_id};
  });
  rig.cycle_power();
  rig.run(500ms);
  ASSERT_EQ(rig.state()->link, LinkState::online) << "nobody has noticed";
  (void)rig.submit(EnableRequest{});
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->link != LinkState::online; }, 3s));
  rig.frames.clear();
  for (int i = 0; i < 3; ++i) {  // the first one learns what the control word holds
    (void)rig.machine->submit("feeder", StopRequest{}, {});
    rig.run(20ms);
  }
  EXPECT_GE(rig.writes_of(0x604000).size(), 2U);
  EXPECT_TRUE(rig.writes_of(0x140002).empty()) << "the RPDO is not set up again yet";
  EXPECT_EQ(rig.count_of(control_rpdo + CanRig::node_id), 0);
}

}  // namespace
}  // namespace axisd::test
