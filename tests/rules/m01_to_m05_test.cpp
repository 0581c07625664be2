// Who may move, and what comes first: M1 to M5.
#include <gtest/gtest.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

void expect_nothing_by_itself(Rig& rig, const char* after) {
  EXPECT_EQ(rig.triggers(), 0) << after;
  EXPECT_EQ(rig.writes_of(0x0029), 0) << after;
  EXPECT_FALSE(rig.drive->shaft_moving()) << after;
}

TEST(M01, NothingByItself) {
  for_each_switch({}, [](const RigOptions& options) {
    for (const bool enabled : {false, true}) {
      Rig rig(options);
      if (enabled) {
        rig.ready();
        rig.complete(MoveAbsoluteRequest{.position = 5});
      }
      rig.line->forget_wire();
      const auto shaft = rig.drive->shaft_pulses();
      const auto starts = rig.drive->starts();
      rig.run(2s);
      expect_nothing_by_itself(rig, "idle");

      rig.line->network().set_connected(false);
      rig.run(2s);
      rig.line->network().set_connected(true);
      rig.reconnect();
      rig.run(1s);
      expect_nothing_by_itself(rig, "the cable was cut");

      rig.line->set_open(false);
      rig.run(1s);
      EXPECT_EQ(rig.state()->link, LinkState::offline);
      rig.line->set_open(true);
      rig.reconnect();
      rig.run(1s);
      expect_nothing_by_itself(rig, "the port was lost");

      rig.drive->raise_alarm(2);
      rig.run(1s);
      rig.drive->raise_alarm(0);
      rig.run(1s);
      expect_nothing_by_itself(rig, "an alarm cleared itself");
      EXPECT_EQ(rig.state()->state, AxisState::error_stop);

      rig.cycle_power(500ms);
      rig.run(5s);
      expect_nothing_by_itself(rig, "power cycle");
      EXPECT_EQ(rig.state()->link, LinkState::online);
      EXPECT_FALSE(rig.state()->enabled_by_us);
      EXPECT_EQ(rig.drive->shaft_pulses(), shaft);
      EXPECT_EQ(rig.drive->starts(), starts);
    }
  });
}

TEST(M01, ShowsTheDrivesOwnEnableBit) {
  Rig energised;
  EXPECT_EQ(energised.state()->state, AxisState::standstill);
  EXPECT_TRUE(energised.state()->enabled);
  EXPECT_FALSE(energised.state()->enabled_by_us);
  Rig released({.switches = {{"enabled_at_power_up", false}}});
  EXPECT_EQ(released.state()->state, AxisState::disabled);
  EXPECT_EQ(released.try_submit(MoveRelativeRequest{.distance = 1}).error().reason, Reason::disabled);
}

/// It says that the frame was lost, and not that a terminal holds the motor.
TEST(M01, AnEnableWhoseFrameWasLostSaysSo) {
  Rig rig({.switches = {{"enabled_at_power_up", false}}});
  rig.fault({.kind = simulation::FaultKind::drop_request, .function = 0x06, .register_address = 0x0029});
  const auto lost = rig.complete(EnableRequest{});
  EXPECT_EQ(lost.state, CommandState::error);
  ASSERT_TRUE(lost.cause);
  EXPECT_EQ(lost.cause->reason, Reason::no_reply) << describe(lost);
  EXPECT_EQ(lost.cause->outcome, Outcome::not_executed);
  EXPECT_NE(lost.cause->message.find("got no reply"), std::string::npos) << lost.cause->message;
  EXPECT_EQ(lost.cause->remedy.find("motor_free"), std::string::npos) << lost.cause->remedy;
  EXPECT_EQ(rig.state()->state, AxisState::disabled);
  EXPECT_EQ(rig.writes_of(0x0029), 1) << "it is not sent again by itself";
  rig.enable();
}

TEST(M01, EnableThatMovesIsStopped) {
  Rig rig({.switches = {{"enabled_at_power_up", false}}});
  const auto enable = rig.submit(EnableRequest{});
  ASSERT_TRUE(rig.run_until([&] { return rig.drive->peek(0x0007) % 32 < 16; }, 1s));
  // Another master starts it just then.
  rig.write_behind(0x0023, 200);
  rig.write_behind(0x0027, 2);
  rig.run(5s);
  EXPECT_EQ(enable->value().state, CommandState::error) << describe(enable->value());
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  EXPECT_FALSE(rig.drive->shaft_moving());
}

TEST(M02, DisableStopsConfirmsThenReleases) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(500ms);
    ASSERT_TRUE(rig.drive->shaft_moving());
    rig.line->forget_wire();
    rig.line->set_on_bind([&](const WireEntry& entry) {
      if (entry.is_write() && entry.address() == 0x0029)
        EXPECT_FALSE(rig.drive->shaft_moving()) << "released in motion";
    });
    const auto disabled = rig.complete(DisableRequest{});
    EXPECT_EQ(disabled.state, CommandState::done) << describe(disabled);
    ASSERT_GE(rig.first_write(0x0028), 0);
    EXPECT_LT(rig.first_write(0x0028), rig.first_write(0x0029));
    EXPECT_EQ(rig.state()->state, AxisState::disabled);
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);  // open loop
  });
}

TEST(M02, NotReleasedWhileStandstillIsNotConfirmed) {
  Rig rig({.switches = {{"stop_ignored_in_homing", true}},
           .adjust = [](AxisSettings& axis) { axis.homing->velocity = 10; }});
  rig.enable();
  rig.submit(HomeRequest{});
  rig.run(500ms);
  ASSERT_TRUE(rig.drive->shaft_moving());
  rig.line->forget_wire();
  const auto disabled = rig.complete(DisableRequest{});
  EXPECT_EQ(disabled.state, CommandState::error);
  EXPECT_EQ(disabled.cause->reason, Reason::not_confirmed);
  EXPECT_EQ(rig.writes_of(0x0029), 0);
}

TEST(M02, ADisabledDriveStaysSoThroughEverything) {
  Rig rig({.persistence = true});
  rig.complete(DisableRequest{});
  rig.stop_daemon();
  rig.idle(1s);
  rig.start_daemon();
  EXPECT_EQ(rig.state()->state, AxisState::disabled);
  EXPECT_EQ(rig.writes_of(0x0029), 0);
}

TEST(M03, EnableIsRefusedUntilConfigured) {
  both_directions({.connect = false}, [](const RigOptions& options) {
    for (const bool inhibited : {false, true}) {
      Rig rig(options);
      if (inhibited) rig.machine->stop_all("test");
      int refused = 0;
      while (rig.state()->link != LinkState::online) {
        for (const Action& action :
             {Action(EnableRequest{}), Action(SetPositionRequest{}), Action(ResetRequest{}),
              Action(MoveRelativeRequest{.distance = 1}), Action(HomeRequest{})}) {
          const auto answer = rig.try_submit(action);
          ASSERT_FALSE(answer) << to_string(kind_of(action)) << " while " << to_string(rig.state()->link);
          ++refused;
        }
        rig.run(1ms);
      }
      EXPECT_GT(refused, 50);
      EXPECT_EQ(rig.writes_of(0x0029), 0);
      EXPECT_EQ(rig.triggers(), 0);
    }
  });
}

TEST(M03, EnableWhileStopAllHoldsIsRefusedInFaultAndStop) {
  Rig rig;
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(500ms);
  rig.machine->stop_all("test");
  EXPECT_EQ(rig.try_submit(EnableRequest{}).error().reason, Reason::stopping);
  EXPECT_EQ(rig.try_submit(SetPositionRequest{}).error().reason, Reason::stopping);
  rig.run(3s);
  rig.drive->raise_alarm(2);
  rig.run(1s);
  EXPECT_EQ(rig.try_submit(EnableRequest{}).error().reason, Reason::alarm);
  rig.line->network().set_connected(false);
  rig.run(2s);
  EXPECT_FALSE(rig.try_submit(EnableRequest{}));
}

TEST(M03, OrderOfConfigurationWrites) {
  both_directions({.adjust =
                       [](AxisSettings& axis) {
                         axis.inputs.push_back({.terminal = "X3", .function = "stop", .active_low = true});
                         axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
                         axis.outputs = {{.terminal = "Y0", .function = "alarm", .active_low = true}};
                         axis.model_settings["overtravel_stop"] = std::string("quick_stop");
                       },
                   .before_start = [](simulation::SimulatedRtuNode& drive,
                                      VirtualWorld&) { write_register(drive, 0x0029, 0); }},
                  [](const RigOptions& options) {
                    Rig rig(options);
                    const auto eeprom = rig.first_write(0x0016), levels = rig.first_write(0x0040);
                    ASSERT_GE(eeprom, 0);
                    EXPECT_LT(eeprom, levels);
                    // X1, X2, X3: limits and stop; X0, X4: the rest, X4 last because it can start motion.
                    for (const std::uint16_t limit : {0x0044, 0x0045, 0x0046}) {
                      EXPECT_LT(levels, rig.first_write(limit));
                      for (const std::uint16_t other : {0x0043, 0x0047, 0x0011, 0x0017})
                        if (rig.first_write(other) >= 0)
                          EXPECT_LT(rig.first_write(limit), rig.first_write(other));
                    }
                    EXPECT_EQ(rig.drive->peek(0x0047), options.invert ? 13 : 12);
                    EXPECT_EQ(rig.drive->peek(0x0044), options.invert ? 3 : 2);
                    EXPECT_EQ(rig.drive->peek(0x0045), options.invert ? 2 : 3);
                    EXPECT_EQ(rig.drive->eeprom_writes(), 0U) << "persist is off";
                  });
}

TEST(M03, StartFunctionsOnlyWhileReleasedAndInactive) {
  RigOptions options{
      .adjust =
          [](AxisSettings& axis) { axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"}); },
      .connect = false};
  Rig rig(options);
  rig.run(3s);
  EXPECT_EQ(rig.state()->link, LinkState::configuring);
  EXPECT_EQ(rig.writes_of(0x0047), 0);
  EXPECT_EQ(rig.try_submit(EnableRequest{}).error().reason, Reason::misconfigured);
  rig.set_input("X4", true);
  // The way out is the one that the error names: release the drive, then open the input.
  const auto disabled = rig.complete(DisableRequest{});
  EXPECT_EQ(disabled.state, CommandState::done) << describe(disabled);
  rig.run(3s);
  EXPECT_EQ(rig.state()->link, LinkState::configuring);
  EXPECT_EQ(rig.writes_of(0x0047), 0);
  rig.set_input("X4", false);
  rig.reconnect();
  EXPECT_EQ(rig.drive->peek(0x0047), 12);
  EXPECT_EQ(rig.drive->starts(), 0);
}

TEST(M03, AFunctionLeftBehindDoesNotStartAtALevelChange) {
  for (const bool edges : {false, true}) {
    // X3 was a JOG input once; now it is the home switch, active low, and nothing is wired to it yet.
    Rig rig({.switches = {{"configuration_makes_edges", edges}},
             .adjust =
                 [](AxisSettings& axis) {
                   axis.inputs[0] = {.terminal = "X3", .function = "home", .active_low = true};
                 },
             .adjust_drive = [](simulation::SimulatedNodeSettings& node) { node.eeprom[0x0046] = 12; }});
    rig.run(1s);
    EXPECT_EQ(rig.drive->starts(), 0);
    EXPECT_EQ(rig.drive->shaft_pulses(), 0);
    EXPECT_EQ(rig.drive->peek(0x0046), 1);
  }
}

TEST(M04, FoundMovingAtStart) {
  for_each_switch({}, [](const RigOptions& base) {
    for (const int mode : {1, 2, 3}) {
      SCOPED_TRACE(mode);
      auto options = base;
      options.before_start = [mode](simulation::SimulatedRtuNode& drive, VirtualWorld& world) {
        write_register(drive, 0x0029, 1);
        write_register(drive, 0x0041 + 2, 1);
        write_register(drive, 0x0031, 1);
        write_register(drive, 0x0023, 100);
        write_register(drive, 0x0024, 2);
        write_register(drive, mode == 3 ? 0x0030 : 0x0027, mode == 3 ? 1 : mode);
        world.run_for(300ms);
        drive.advance(world.now());
        EXPECT_TRUE(drive.shaft_moving());
      };
      options.connect = false;
      Rig rig(options);
      rig.run_until([&] { return rig.first_write(0x0028) >= 0; }, 1s);
      const auto first = std::ranges::find_if(rig.line->wire(), &WireEntry::is_write);
      ASSERT_NE(first, rig.line->wire().end());
      EXPECT_EQ(first->address(), 0x0028);
      rig.run(10s);
      EXPECT_EQ(rig.triggers(), 0);
      const auto ignored = options.switches.contains("stop_ignored_in_homing") && mode == 3;
      if (!ignored) {
        EXPECT_FALSE(rig.drive->shaft_moving());
        EXPECT_EQ(rig.state()->link, LinkState::online);
      }
    }
  });
}

TEST(M04, AStopIsTheFirstFrameAfterACableCut) {
  for_each_switch({.limits = false}, [](const RigOptions& options) {
    const Action motions[] = {MoveVelocityRequest{.velocity = 50},
                              MoveAbsoluteRequest{.position = 3000, .with = {.velocity = 50}}, HomeRequest{}};
    for (const auto& motion : motions) {
      for (const bool port : {false, true}) {
        SCOPED_TRACE(to_string(kind_of(motion)));
        Rig rig(options);
        rig.ready();
        const auto command = rig.submit(motion);
        rig.run(400ms);
        port ? rig.line->set_open(false) : rig.line->network().set_connected(false);
        rig.run(600ms);
        EXPECT_EQ(command->value().state, CommandState::unknown) << describe(command->value());
        EXPECT_EQ(rig.state()->link, LinkState::offline);
        EXPECT_EQ(rig.state()->state, AxisState::error_stop);
        rig.line->forget_wire();
        rig.line->network().set_connected(true);
        rig.line->set_open(true);
        rig.run_until([&] { return !rig.line->wire().empty(); }, 5s);
        ASSERT_FALSE(rig.line->wire().empty());
        EXPECT_EQ(rig.line->wire().front().address(), 0x0028);
        EXPECT_TRUE(rig.line->wire().front().is_write());
        rig.run(15s);
        EXPECT_FALSE(rig.drive->shaft_moving());
        EXPECT_EQ(rig.triggers(), 0);
        EXPECT_EQ(rig.state()->link, LinkState::online);
        EXPECT_EQ(rig.state()->state, AxisState::error_stop);
        EXPECT_EQ(rig.complete(ResetRequest{}).state, CommandState::done);
      }
    }
  });
}

TEST(M04, AnOwedStopStaysOwedWhileItsRepliesAreLost) {
  Rig rig({.limits = false});
  rig.ready();
  rig.submit(MoveVelocityRequest{.velocity = 50});
  rig.run(400ms);
  rig.line->network().set_connected(false);
  rig.run(1s);
  rig.line->network().set_connected(true);
  rig.fault({.kind = simulation::FaultKind::drop_request, .register_address = 0x0028, .count = 4});
  rig.run(1ms);
  rig.line->forget_wire();
  rig.run(8s);
  EXPECT_GE(rig.writes_of(0x0028), 4);
  EXPECT_FALSE(rig.drive->shaft_moving());
  for (std::size_t i = 0; i < 4 && i < rig.line->wire().size(); ++i)
    EXPECT_EQ(rig.line->wire()[i].address(), 0x0028);
}

TEST(M05, AlarmsLatchAndStop) {
  for_each_switch({}, [](const RigOptions& options) {
    for (const int code : {1, 2, 3, 4, 5}) {
      SCOPED_TRACE(code);
      Rig rig(options);
      rig.ready();
      const auto move = rig.submit(MoveAbsoluteRequest{.position = 300});
      rig.run(500ms);
      rig.line->forget_wire();
      rig.drive->raise_alarm(code);
      rig.run(60ms);
      rig.drive->raise_alarm(0);
      rig.run(3s);
      EXPECT_EQ(move->value().state, CommandState::error);
      EXPECT_EQ(move->value().cause->reason, Reason::alarm);
      EXPECT_EQ(move->value().cause->where.native_code, static_cast<std::uint32_t>(code));
      EXPECT_EQ(rig.state()->state, AxisState::error_stop);
      EXPECT_GE(rig.writes_of(0x0028), 1);
      EXPECT_LE(rig.writes_of(0x0028), 2);
      EXPECT_EQ(rig.triggers(), 0);
      EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
      EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 0}).error().reason, Reason::alarm);
      const auto reset = rig.try_submit(ResetRequest{});
      EXPECT_EQ(reset.has_value(), code >= 2 && code <= 4);
      rig.run(1s);
      EXPECT_EQ(rig.state()->state == AxisState::error_stop, code == 1 || code == 5);
    }
  });
}

TEST(M05, AnotherAlarmReplacesTheFirstAndIsStoppedOnce) {
  Rig rig;
  rig.ready();
  rig.drive->raise_alarm(2);
  rig.run(1s);
  rig.drive->raise_alarm(0);
  rig.run(1s);
  rig.line->forget_wire();
  rig.drive->raise_alarm(3);
  rig.run(5s);
  EXPECT_EQ(rig.state()->fault->where.native_code, 3U);
  EXPECT_GE(rig.writes_of(0x0028), 1);
  EXPECT_LE(rig.writes_of(0x0028), 2);
}

}  // namespace
}  // namespace axisd::test
