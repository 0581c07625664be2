// Stopping: M12 to M15.
#include <gtest/gtest.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

std::vector<std::uint16_t> stop_values(const Rig& rig) {
  std::vector<std::uint16_t> values;
  for (const auto& entry : rig.line->wire())
    if (entry.is_write() && entry.address() == 0x0028) values.push_back(entry.value());
  return values;
}

TEST(M12, HaltAndStopWriteZeroQuickStopOne) {
  for_each_switch({.limits = false}, [](const RigOptions& options) {
    const Action motions[] = {MoveVelocityRequest{.velocity = 50}, MoveAbsoluteRequest{.position = 300},
                              HomeRequest{}};
    for (const auto& motion : motions) {
      if (options.switches.contains("stop_ignored_in_homing") && kind_of(motion) == CommandKind::home)
        continue;
      for (const auto kind : {StopKind::halt, StopKind::stop, StopKind::quick_stop}) {
        Rig rig(options);
        rig.ready();
        const auto command = rig.submit(motion);
        rig.run(500ms);
        ASSERT_TRUE(rig.drive->shaft_moving());
        rig.line->forget_wire();
        const auto stop = rig.complete(StopRequest{.kind = kind});
        EXPECT_EQ(stop.state, CommandState::done) << describe(stop);
        EXPECT_EQ(command->value().state, CommandState::aborted);
        EXPECT_EQ(command->value().cause->reason, Reason::superseded);
        EXPECT_EQ(stop_values(rig), std::vector<std::uint16_t>(1, kind == StopKind::quick_stop ? 1 : 0));
        EXPECT_FALSE(rig.drive->shaft_moving());
        EXPECT_EQ(rig.state()->state, AxisState::standstill);
        if (kind_of(motion) != CommandKind::home)
          EXPECT_EQ(rig.state()->trust,
                    kind == StopKind::quick_stop ? PositionTrust::unknown : PositionTrust::set);
        else
          EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
      }
    }
  });
}

TEST(M12, TheStopSaysWhatDecelerationIsUsed) {
  Rig rig;
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 300, .with = {.deceleration_time = 700ms}});
  rig.run(500ms);
  const auto stop = rig.complete(StopRequest{.kind = StopKind::halt});
  ASSERT_TRUE(stop.granted.deceleration_time);
  EXPECT_EQ(*stop.granted.deceleration_time, 700ms);
}

TEST(M13, StopsGoToAxesBelievedIdle) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.run(1s);
    rig.line->forget_wire();
    const auto stop = rig.complete(StopRequest{});
    EXPECT_EQ(stop.state, CommandState::done);
    EXPECT_EQ(rig.writes_of(0x0028), 1);
  });
}

/// Homing ignores 0x0028 with this switch: each step of the escalation is needed.
TEST(M13, Escalation) {
  both_directions({.switches = {{"stop_ignored_in_homing", true}}}, [](const RigOptions& base) {
    for (const bool release : {false, true}) {
      auto options = base;
      options.adjust = [release](AxisSettings& axis) {
        axis.homing->velocity = 10;
        axis.stop_escalation_release = release;
      };
      Rig rig(options);
      rig.enable();
      rig.submit(HomeRequest{});
      rig.run(500ms);
      rig.line->forget_wire();
      const auto stop = rig.complete(StopRequest{});
      auto expected = std::vector<std::uint16_t>{0, 1};
      if (release) expected.push_back(1);
      EXPECT_EQ(stop_values(rig), expected);
      if (release) {
        EXPECT_EQ(stop.state, CommandState::done) << describe(stop);
        EXPECT_EQ(rig.writes_of(0x0029), 1);
        EXPECT_FALSE(rig.drive->shaft_moving());
        EXPECT_EQ(rig.state()->state, AxisState::disabled);
        EXPECT_LT(rig.first_write(0x0028), rig.first_write(0x0029));
      } else {
        EXPECT_EQ(stop.state, CommandState::error);
        EXPECT_EQ(stop.cause->reason, Reason::not_confirmed);
        EXPECT_EQ(rig.writes_of(0x0029), 0);
        EXPECT_EQ(rig.state()->state, AxisState::error_stop);
        EXPECT_FALSE(rig.try_submit(MoveRelativeRequest{.distance = 1}));
      }
    }
  });
}

TEST(M13, ARampLongerThanTheMarginIsNotEscalated) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    rig.submit(MoveAbsoluteRequest{
        .position = 390, .with = {.velocity = 100, .acceleration_time = 200ms, .deceleration_time = 2000ms}});
    rig.run(900ms);
    rig.line->forget_wire();
    const auto stop = rig.complete(StopRequest{});
    EXPECT_EQ(stop.state, CommandState::done) << describe(stop);
    EXPECT_EQ(stop_values(rig), std::vector<std::uint16_t>{0});
    EXPECT_EQ(rig.state()->trust, PositionTrust::set);
  });
}

/// Nobody polls an axis that is not online: its stop looks for the standstill itself.
TEST(M13, AQuickStopWaitsForNoRampOfAnAxisThatIsNotOnline) {
  RigOptions options{.limits = false, .connect = false};
  options.before_start = [](simulation::SimulatedRtuNode& drive, VirtualWorld& world) {
    write_register(drive, 0x0029, 1);
    write_register(drive, 0x0022, 2000);  // ms
    write_register(drive, 0x0023, 600);
    write_register(drive, 0x0027, 2);
    world.run_for(500ms);
    drive.advance(world.now());
    EXPECT_TRUE(drive.shaft_moving());
  };
  Rig rig(options);
  ASSERT_TRUE(rig.run_until([&] { return rig.writes_of(0x0028) > 0; }, 1s)) << "found moving";
  rig.submit(StopRequest{.kind = StopKind::halt});
  rig.run(200ms);
  ASSERT_NE(rig.state()->link, LinkState::online);
  ASSERT_TRUE(rig.drive->shaft_moving());
  rig.submit(StopRequest{.kind = StopKind::quick_stop});
  rig.run(100ms);
  EXPECT_EQ(stop_values(rig).back(), 1);
}

/// The stop itself never arrives: it is repeated, then escalated, and never silently given up.
TEST(M13, AStopThatNeverArrives) {
  for (const auto kind : {FaultKind::drop_request, FaultKind::drop_reply, FaultKind::corrupt_reply}) {
    for (const bool release : {false, true}) {
      Rig rig({.adjust = [release](AxisSettings& axis) { axis.stop_escalation_release = release; },
               .limits = false});
      rig.ready();
      rig.submit(MoveVelocityRequest{.velocity = 50});
      rig.run(500ms);
      rig.line->forget_wire();
      rig.fault({.kind = kind, .register_address = 0x0028, .count = -1});
      const auto stop = rig.submit(StopRequest{});
      EXPECT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 10s)) << "stops for ever";
      EXPECT_GE(rig.writes_of(0x0028), 3);
      if (kind != FaultKind::drop_request) {
        EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
        EXPECT_FALSE(rig.drive->shaft_moving());
      } else if (release) {
        EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
        EXPECT_EQ(rig.writes_of(0x0029), 1);
        EXPECT_FALSE(rig.drive->shaft_moving());
      } else {
        EXPECT_EQ(stop->value().state, CommandState::error) << describe(stop->value());
        EXPECT_EQ(stop->value().cause->reason, Reason::not_confirmed);
        rig.faults().clear();
        rig.run(5s);
        EXPECT_FALSE(rig.drive->shaft_moving()) << "it moved without a command, and the line works again";
      }
    }
  }
}

/// A drive that rests anyway proves nothing about the stop.
TEST(M13, AStopToADriveAtRestIsSentUntilItArrives) {
  Rig rig;
  rig.ready();
  int arrived = 0;
  rig.line->set_on_bind([&](const WireEntry& entry) {
    if (entry.address() == 0x0028 && rig.faults().pending() == 0) ++arrived;
  });
  rig.fault({.kind = FaultKind::drop_request, .register_address = 0x0028, .count = 5});
  const auto stop = rig.submit(StopRequest{});
  EXPECT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 10s));
  EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
  EXPECT_EQ(arrived, 2)
      << "the first echo may be that of one before, which was late: once more after a reading";
}

TEST(M13, StopWithActiveStopTerminalsAndInPtPv) {
  for (const int mode : {2, 3}) {
    for (const bool ignored : {false, true}) {
      Rig rig({.switches = {{"stop_ignored_in_pt_pv", ignored}},
               .adjust =
                   [mode](AxisSettings& axis) {
                     axis.inputs.push_back(
                         {.terminal = "X3", .function = mode == 2 ? "pt_enable" : "pv_enable"});
                     axis.inputs.push_back({.terminal = "X4", .function = "pin0"});
                   },
               .before_start = [](auto& drive, VirtualWorld&) { write_register(drive, 0x0029, 0); }});
      rig.enable();
      rig.write_behind(0x0090, 4);
      rig.write_behind(0x00B0, 100);
      rig.write_behind(0x00E0, 100);
      rig.write_behind(0x00C0, 100);
      rig.set_input("X4", true);
      rig.run(50ms);
      rig.set_input("X3", true);
      rig.run(1s);
      ASSERT_TRUE(rig.drive->shaft_moving());
      EXPECT_EQ(rig.state()->state, mode == 2 ? AxisState::discrete_motion : AxisState::continuous_motion);
      EXPECT_EQ(rig.writes_of(0x0028), 0) << "a terminal's motion is its owner's business";
      const auto stop = rig.complete(StopRequest{});
      EXPECT_EQ(stop.state, ignored ? CommandState::error : CommandState::done) << describe(stop);
      EXPECT_EQ(rig.drive->shaft_moving(), ignored);
    }
  }
}

TEST(M14, StoppingUntilStandstillIsMeasured) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(700ms);
    const auto stop = rig.submit(StopRequest{});
    while (!stop->has_ended()) {
      ASSERT_EQ(rig.state()->state, AxisState::stopping);
      EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 0}).error().reason, Reason::stopping);
      EXPECT_EQ(rig.try_submit(JogRequest{.velocity = 5}).error().reason, Reason::stopping);
      EXPECT_EQ(rig.try_submit(HomeRequest{}).error().reason, Reason::stopping);
      rig.run(1ms);
    }
    EXPECT_FALSE(rig.drive->shaft_moving());
    EXPECT_EQ(rig.state()->state, AxisState::standstill);
    EXPECT_TRUE(rig.try_submit(MoveAbsoluteRequest{.position = 0}));
  });
}

TEST(M14, HoldUntilReleaseStop) {
  Rig rig;
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(300ms);
  const auto stop = rig.complete(StopRequest{.hold = true});
  EXPECT_EQ(stop.state, CommandState::done);
  rig.run(5s);
  EXPECT_EQ(rig.state()->state, AxisState::stopping);
  EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 0}).error().reason, Reason::stopping);
  EXPECT_EQ(rig.try_submit(EnableRequest{}).error().reason, Reason::stopping);
  rig.complete(StopRequest{});
  EXPECT_EQ(rig.state()->state, AxisState::stopping) << "another stop does not end the hold";
  std::vector<Result<StopReleased>> released;
  const auto release = [&] {
    rig.machine->release_stop("feeder", {}, [&](auto result) { released.push_back(std::move(result)); });
  };
  release();
  EXPECT_EQ(rig.state()->state, AxisState::standstill);
  release();
  ASSERT_EQ(released.size(), 2U);
  EXPECT_TRUE(released.at(0));
  EXPECT_EQ(released.at(1).error().reason, Reason::invalid_argument);
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 0}).state, CommandState::done);
}

TEST(M14, HaltMayBeOverriddenStopMayNot) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const MotionValues slow_ramp{.deceleration_time = 1500ms};
    rig.submit(MoveAbsoluteRequest{.position = 300, .with = slow_ramp});
    rig.run(700ms);
    const auto halt = rig.submit(StopRequest{.kind = StopKind::halt});
    EXPECT_EQ(rig.state()->state, AxisState::discrete_motion);
    rig.run(100ms);
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 10});
    rig.run(10s);
    EXPECT_EQ(halt->value().state, CommandState::done);
    EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
    EXPECT_EQ(rig.load_mm(), 10);
  });
}

/// A stop at every point of the start chain and after it: nothing accepted before is sent after.
TEST(M14, NothingAcceptedBeforeAStopIsSentAfterIt) {
  both_directions({.limits = false}, [](const RigOptions& options) {
    const Action motions[] = {MoveAbsoluteRequest{.position = 100}, MoveVelocityRequest{.velocity = 50},
                              JogRequest{.velocity = 50, .hold = 2s}, HomeRequest{}};
    for (const auto& motion : motions) {
      for (int offset = 0; offset < 160; ++offset) {
        for (const bool lane : {false, true}) {
          SCOPED_TRACE(std::string(to_string(kind_of(motion))) + " " + std::to_string(offset));
          Rig rig(options);
          rig.ready();
          rig.run(std::chrono::microseconds(offset * 731 % 9000));
          const auto command = rig.submit(motion);
          rig.run(std::chrono::microseconds(offset * 250));
          // From another thread the gate is raised first; the core sees the stop a little later.
          if (lane) {
            rig.axis().gate()->request_stop();
            EXPECT_FALSE(rig.try_submit(MoveAbsoluteRequest{.position = 50}));
            rig.run(std::chrono::microseconds(offset % 7 * 300));
          }
          const auto sent_before = rig.triggers();
          const auto stop = rig.submit(StopRequest{});
          EXPECT_EQ(command->value().state, CommandState::aborted) << describe(command->value());
          rig.run(3s);
          EXPECT_EQ(rig.triggers(), sent_before);
          EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
          EXPECT_FALSE(rig.drive->shaft_moving());
          // The stop follows whatever had been bound.
          const auto last_trigger = std::ranges::find_if(rig.line->wire(), [](const WireEntry& entry) {
            return entry.is_write() && (entry.address() == 0x0027 || entry.address() == 0x0030);
          });
          if (last_trigger != rig.line->wire().end())
            EXPECT_GT(rig.first_write(0x0028), last_trigger - rig.line->wire().begin());
        }
      }
    }
  });
}

TEST(M14, StopAllInhibitsUntilReleasedAndSurvivesARestart) {
  Rig rig({.persistence = true});
  rig.ready();
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(500ms);
  const auto stops = rig.machine->stop_all("operator");
  ASSERT_EQ(stops.size(), 1U);
  rig.run(5s);
  EXPECT_EQ(move->value().state, CommandState::aborted);
  EXPECT_EQ((*stops[0])->value().state, CommandState::done);
  EXPECT_FALSE(rig.drive->shaft_moving());
  const auto refuse_all = [&] {
    rig.line->forget_wire();
    for (const Action& action :
         {Action(MoveAbsoluteRequest{.position = 1}), Action(MoveRelativeRequest{.distance = 1}),
          Action(JogRequest{.velocity = 5}), Action(MoveVelocityRequest{.velocity = 5}),
          Action(HomeRequest{})})
      for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(rig.try_submit(action).error().reason, Reason::inhibited);
        rig.run(10ms);
      }
    EXPECT_EQ(rig.triggers(), 0);
    EXPECT_TRUE(rig.state()->inhibited);
  };
  refuse_all();
  rig.stop_daemon();
  rig.start_daemon();
  refuse_all();
  EXPECT_EQ(*rig.machine->inhibited_by(), "operator");
  const auto changes = [&] {
    std::vector<std::pair<InhibitChange::What, std::string>> all;
    for (const auto& event : rig.machine->events().events_after(0, 1000).events)
      if (const auto* change = std::get_if<InhibitChange>(&event.content))
        all.emplace_back(change->what, change->by);
    return all;
  };
  EXPECT_THAT(changes(), testing::ElementsAre(std::pair(InhibitChange::What::stands, "operator")))
      << "those of the run before are gone with it";

  // The release counts once it is durable.
  rig.store.failing = true;
  std::optional<Result<void>> released;
  rig.machine->release_inhibit("operator", [&](Result<void> result) { released = result; });
  rig.run(10ms);
  EXPECT_FALSE(released->has_value());
  EXPECT_TRUE(rig.state()->inhibited);
  rig.store.failing = false;
  rig.machine->release_inhibit("shift leader", [&](Result<void> result) { released = result; });
  rig.run(10ms);
  EXPECT_TRUE(released->has_value());
  rig.machine->stop_all("hmi");
  rig.run(10ms);
  rig.machine->release_inhibit("hmi", [&](Result<void> result) { released = result; });
  rig.run(10ms);
  EXPECT_THAT(changes(), testing::ElementsAre(std::pair(InhibitChange::What::stands, "operator"),
                                              std::pair(InhibitChange::What::released, "shift leader"),
                                              std::pair(InhibitChange::What::latched, "hmi"),
                                              std::pair(InhibitChange::What::released, "hmi")));
  EXPECT_FALSE(rig.state()->inhibited);
  EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 1}).state, CommandState::done);
}

TEST(M14, CancelHaltsOnlyItsOwnCommand) {
  Rig rig;
  rig.ready();
  const auto first = rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(300ms);
  const auto second = rig.submit(MoveAbsoluteRequest{.position = 200});
  rig.run(500ms);
  EXPECT_TRUE(rig.axis().cancel(first));
  rig.run(100ms);
  EXPECT_FALSE(second->has_ended());
  EXPECT_TRUE(rig.axis().cancel(second));
  EXPECT_EQ(second->value().state, CommandState::aborted);
  EXPECT_EQ(second->value().cause->reason, Reason::cancelled);
  rig.run(2s);
  EXPECT_FALSE(rig.drive->shaft_moving());
  EXPECT_EQ(rig.state()->state, AxisState::standstill);
}

/// The stop's frame follows the transaction under way and its silence, also past a silent neighbour.
TEST(M15, AStopWaitsForOneTransactionOnly) {
  both_directions({.limits = false}, [](const RigOptions& options) {
    for (int offset = 0; offset < 60; ++offset) {
      Rig rig(options);
      rig.ready();
      rig.submit(MoveVelocityRequest{.velocity = 50});
      rig.run(500ms + std::chrono::milliseconds(offset));
      rig.line->forget_wire();
      const auto asked = rig.world.now();
      rig.submit(StopRequest{});
      rig.run(100ms);
      ASSERT_GE(rig.first_write(0x0028), 0);
      EXPECT_LE(rig.line->wire()[static_cast<std::size_t>(rig.first_write(0x0028))].begin - asked, 10ms);
    }
  });
}

/// The echo of a stop before it is no echo of its own, and a question that came to nothing does not tell
/// which one it was.
TEST(M14, AStopThatMayNotHaveBeenHeardIsSentAgain) {
  Rig rig({.switches = {{"crc_error_answered", true}}});
  rig.ready();
  auto& network = rig.line->network();
  const auto on_stop = [](simulation::FaultKind kind, Duration delay = {}) {
    return simulation::Fault{
        .kind = kind, .function = std::uint8_t{6}, .register_address = std::uint16_t{0x0028}, .delay = delay};
  };
  // Its reply comes while the next one is awaited.
  network.faults().add(on_stop(simulation::FaultKind::delay_reply, 60ms));
  const auto first = rig.submit(StopRequest{.kind = StopKind::halt});
  rig.run(10ms);
  network.faults().add(on_stop(simulation::FaultKind::drop_request));
  network.faults().add(
      {.kind = simulation::FaultKind::corrupt_request, .function = std::uint8_t{3}, .count = 1});
  rig.line->forget_wire();
  const auto second = rig.submit(StopRequest{.kind = StopKind::stop});
  ASSERT_TRUE(rig.run_until([&] { return second->has_ended(); }, 10s));
  const auto sent = std::ranges::count_if(
      rig.line->wire(), [](const WireEntry& entry) { return entry.is_write() && entry.address() == 0x0028; });
  EXPECT_GE(sent, 2) << "one of them was lost";
  EXPECT_EQ(second->value().state, CommandState::done);
}

}  // namespace
}  // namespace axisd::test
