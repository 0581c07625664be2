// The drive's memory (M27), what others change in it, brakes (M2), motion by terminals and edges (M29).
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/rules/operate.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

Result<std::vector<ParameterValue>> write(Rig& rig, std::vector<ParameterValue> values) {
  return operate<std::vector<ParameterValue>>(
      rig, [values](const DriveOperations& drive) { return drive.write_parameters(values); });
}

Result<void> save(Rig& rig) {
  return operate<void>(rig, [](const DriveOperations& drive) { return drive.save_parameters(); });
}

constexpr std::uint16_t first_motion_register = 0x0020, save_or_restore = 0x002B, microstep = 0x0011,
                        x1_function = 0x0044, filter = 0x0118;

TEST(M27, WritesAreCheckedBeforeAnythingIsSent) {
  Rig rig;
  rig.line->forget_wire();
  const auto sent = [&] {
    return std::ranges::count_if(rig.line->wire(), [](const WireEntry& entry) { return entry.is_write(); });
  };
  const auto good = ParameterValue{filter, 12};
  EXPECT_EQ(write(rig, {good, {filter + 1, 70'000}}).error().reason, Reason::out_of_range);
  EXPECT_EQ(write(rig, {good, {0x0019, 1}}).error().reason, Reason::invalid_argument);  // a hole
  EXPECT_EQ(write(rig, {good, {0x0007, 1}}).error().reason, Reason::invalid_argument);  // read-only
  const auto trigger = write(rig, {good, {0x0027, 5}});
  EXPECT_EQ(trigger.error().remedy, "use AxisService.MoveAbsolute");
  const auto owned = write(rig, {good, {x1_function, 0}});
  EXPECT_NE(owned.error().message.find("inputs.X1"), std::string::npos) << owned.error().message;
  EXPECT_FALSE(write(rig, {good, {first_motion_register, 10}}));
  EXPECT_EQ(sent(), 0);
  rig.enable();
  rig.line->forget_wire();
  EXPECT_EQ(write(rig, {good}).error().reason, Reason::moving);
  EXPECT_EQ(sent(), 0);
}

TEST(M27, WritesAreReadBack) {
  Rig rig;
  rig.complete(DisableRequest{});
  const auto written = write(rig, {{filter, 12}, {0x0110, 700}});
  ASSERT_TRUE(written) << to_string(written.error());
  EXPECT_EQ(*written, (std::vector<ParameterValue>{{filter, 12}, {0x0110, 700}}));
  EXPECT_EQ(rig.drive->peek(filter), 12);
}

TEST(M27, ASavedDriveMovesNothingAndItsRestartIsStillNoticed) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 5}).state, CommandState::done);
    EXPECT_EQ(save(rig).error().reason, Reason::moving) << "the power stage is on";
    rig.complete(DisableRequest{});
    rig.line->forget_wire();
    const auto saved = save(rig);
    ASSERT_TRUE(saved) << to_string(saved.error());
    // What the EEPROM holds now would go nowhere if a terminal started it.
    const auto before = rig.first_write(first_motion_register);
    ASSERT_GE(before, 0);
    EXPECT_LT(before, rig.first_write(save_or_restore));
    const auto block = rig.line->wire()[static_cast<std::size_t>(before)].block();
    EXPECT_EQ(block.at(3), 0) << "speed";
    EXPECT_EQ(block.at(4), 0);
    EXPECT_EQ(block.at(5), 0) << "pulses";
    rig.cycle_power();
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 5s));
    rig.reconnect();
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    EXPECT_FALSE(rig.state()->enabled_by_us);
  });
}

/// The reply to the saving is lost, or that to the canary after it: a power cycle must still be seen.
TEST(M27, ASavedBlockIsNoProofWhateverGetsLost) {
  for (const std::uint16_t lost : {save_or_restore, first_motion_register})
    for (const int skip : {0, 1}) {
      Rig rig;
      rig.ready();
      rig.complete(DisableRequest{});
      rig.fault({.kind = simulation::FaultKind::drop_reply,
                 .function = lost == save_or_restore ? 0x06 : 0x10,
                 .register_address = lost,
                 .skip = skip,
                 .count = 4});
      (void)save(rig);
      rig.faults().clear();
      rig.reconnect();
      rig.enable();
      rig.complete(SetPositionRequest{.position = 30});
      rig.drive->advance(rig.world.now());
      rig.drive->set_power(false);
      rig.run(20ms);
      rig.drive->advance(rig.world.now());
      rig.drive->set_power(true);
      EXPECT_TRUE(rig.run_until([&] { return rig.state()->trust == PositionTrust::unknown; }, 5s))
          << lost << skip;
    }
}

/// What comes up after it holds the block that was saved: nothing tells it from the drive that saved it.
TEST(M27, ARestartInPlaceOfTheReplyToTheSavingIsNotHidden) {
  for (const auto* model : {"ess42-r", "ssd2608pr"}) {
    SCOPED_TRACE(model);
    Rig rig({.model = model, .adjust = [](AxisSettings& axis) {
               axis.homing->method = HomingMethod::negative_limit;
               axis.model_settings["released_position"] = std::string("counted");
             }});
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 30}).state, CommandState::done);
    EXPECT_EQ(rig.complete(DisableRequest{}).state, CommandState::done);
    ASSERT_NE(rig.state()->trust, PositionTrust::unknown);
    rig.fault({.kind = simulation::FaultKind::reboot_after,
               .function = 0x06,
               .register_address = save_or_restore,
               .delay = 10ms});
    const auto saved = save(rig);
    ASSERT_FALSE(saved);
    EXPECT_EQ(saved.error().outcome, Outcome::unknown) << to_string(saved.error());
    rig.reconnect();
    rig.run(2s);
    EXPECT_EQ(rig.state()->link, LinkState::online);
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  }
}

TEST(M7, ARestartIsSeenWhileTheConfigurationIsAppliedAgain) {
  // Drift first, then a power cycle before it was applied again: configure() must not overwrite the evidence.
  Rig rig({.switches = {{"enabled_at_power_up", false}},
           .adjust = [](AxisSettings& axis) { axis.drift_check = 1s; }});
  rig.ready();
  rig.complete(DisableRequest{});
  rig.enable();
  rig.complete(SetPositionRequest{.position = 30});
  for (int blip = 0; blip < 20; ++blip) {
    rig.enable();
    rig.complete(SetPositionRequest{.position = 30});
    rig.run(std::chrono::milliseconds(50 * blip));
    const int seen = rig.state()->reboots;
    rig.cycle_power(10ms);
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->reboots == seen + 1; }, 5s)) << blip;
    rig.reconnect();
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  }
}

TEST(M3, DriftOutlastsAShortLossOfTheLink) {
  Rig rig({.adjust = [](AxisSettings& axis) { axis.drift_check = 1s; }});
  rig.ready();
  rig.write_behind(x1_function, 0);
  EXPECT_TRUE(rig.run_until([&] { return !rig.state()->drift.empty(); }, 3s));
  rig.fault({.kind = simulation::FaultKind::drop_request, .count = 8});
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 5s));
  rig.reconnect();
  EXPECT_FALSE(rig.state()->drift.empty());
  EXPECT_EQ(rig.try_submit(MoveRelativeRequest{.distance = 1}).error().reason, Reason::misconfigured);
}

TEST(M3, TerminalsChangedWhileTheLinkWasLostAreSeenBeforeAnythingMoves) {
  Rig rig;
  rig.ready();
  rig.fault({.kind = simulation::FaultKind::drop_request, .count = 8});
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 5s));
  rig.write_behind(x1_function, 0);
  rig.reconnect();
  EXPECT_FALSE(rig.state()->drift.empty());
}

TEST(M14, AStopThatTheDriveCallsDamagedIsRepeatedAtOnce) {
  Rig rig({.switches = {{"crc_error_answered", true}}});
  rig.ready();
  const auto move = rig.submit(
      MoveAbsoluteRequest{.position = 300, .with = {.position = {}, .distance = {}, .velocity = 50}});
  rig.run_until([&] { return rig.state()->position > 20; }, 5s);
  rig.line->forget_wire();
  rig.fault({.kind = simulation::FaultKind::corrupt_request, .register_address = 0x0028});
  const auto before = rig.load_mm();
  const auto stop = rig.submit(StopRequest{.kind = StopKind::stop});
  rig.run_until([&] { return stop->has_ended(); }, 5s);
  EXPECT_EQ(stop->value().state, CommandState::done);
  EXPECT_EQ(rig.state()->trust, PositionTrust::set) << "no quick stop was needed";
  EXPECT_LT(rig.load_mm() - before, 10);
  EXPECT_EQ(rig.writes_of(0x0028), 2);
}

TEST(M14, AStopEndsOnAnAxisThatStaysUnconfigured) {
  Rig rig({.connect = false, .before_start = [](simulation::SimulatedRtuNode& drive, VirtualWorld&) {
             drive.poke(0x0000, 0x0999);  // another model answers
           }});
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::configuring; }, 5s));
  const auto stop = rig.submit(StopRequest{.kind = StopKind::stop});
  EXPECT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 10s));
  EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
  EXPECT_TRUE(rig.axis().at_rest());
}

TEST(M20, HomingThatATerminalStartedWhileTheLinkWasLostCostsThePosition) {
  Rig rig({.switches = {{"enabled_at_power_up", false}}, .adjust = [](AxisSettings& axis) {
             axis.inputs.push_back({.terminal = "X6", .function = "homing_start"});
           }});
  rig.ready();
  rig.fault({.kind = simulation::FaultKind::drop_request, .count = 12});
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 5s));
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
}

TEST(M2, WhatMovesWhileTheBrakeOpensIsStopped) {
  Rig rig({.switches = {{"enabled_at_power_up", false}}, .adjust = [](AxisSettings& axis) {
             axis.outputs = {{.terminal = "Y0", .function = "brake"}};
             axis.brake = {.release_time = 1s};
             axis.inputs.push_back({.terminal = "X6", .function = "jog_positive"});
           }});
  const auto enable = rig.submit(EnableRequest{});
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->enabled; }, 1s));
  rig.run(100ms);
  rig.set_input("X6", true);
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->state == AxisState::error_stop; }, 1s));
  EXPECT_NE(enable->value().state, CommandState::done);
}

TEST(M27, RestoredSettingsAreConfiguredAgain) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    rig.complete(DisableRequest{});
    const auto restored =
        operate<std::string>(rig, [](const DriveOperations& drive) { return drive.restore_factory({}); });
    ASSERT_TRUE(restored) << to_string(restored.error());
    EXPECT_NE(restored->find("address 1"), std::string::npos) << *restored;
    EXPECT_EQ(rig.state()->link, LinkState::configuring);
    rig.reconnect();
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    EXPECT_EQ(rig.drive->peek(microstep), 8);  // 1000 pulses/rev
    EXPECT_NE(rig.drive->peek(x1_function), 0);
    EXPECT_EQ(rig.drive->starts(), 0);
  });
}

TEST(M3, WhatAnotherMasterChangedIsAppliedAgainOnceReleased) {
  Rig rig({.adjust = [](AxisSettings& axis) { axis.drift_check = 1s; }});
  rig.complete(DisableRequest{});
  const auto was = rig.drive->peek(x1_function);
  rig.write_behind(x1_function, 0);
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::configuring; }, 3s));
  rig.reconnect();
  EXPECT_EQ(rig.drive->peek(x1_function), was);

  rig.ready();
  rig.write_behind(x1_function, 0);
  EXPECT_TRUE(rig.run_until([&] { return !rig.state()->drift.empty(); }, 3s));
  EXPECT_NE(rig.state()->drift.find("inputs.X1"), std::string::npos) << rig.state()->drift;
  EXPECT_EQ(rig.drive->peek(x1_function), 0) << "not while the power stage is on";
  const auto move = rig.try_submit(MoveRelativeRequest{.distance = 1});
  ASSERT_FALSE(move);
  EXPECT_EQ(move.error().reason, Reason::misconfigured);
  EXPECT_EQ(rig.complete(DisableRequest{}).state, CommandState::done);
  EXPECT_TRUE(rig.run_until([&] { return rig.drive->peek(x1_function) == was; }, 3s));
  rig.reconnect();
  EXPECT_TRUE(rig.state()->drift.empty());
}

TEST(M20, AnotherMicrostepCostsThePosition) {
  Rig rig({.adjust = [](AxisSettings& axis) { axis.drift_check = 1s; }});
  rig.ready();
  rig.write_behind(microstep, 9);
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->trust == PositionTrust::unknown; }, 3s));
}

TEST(M2, ABrakeIsGivenItsTime) {
  const RigOptions options{.adjust = [](AxisSettings& axis) {
    axis.outputs = {{.terminal = "Y0", .function = "brake"}};
    axis.brake = {.release_time = 300ms, .engage_time = 200ms};
  }};
  Rig rig(options);
  auto began = rig.world.now();
  const auto enable = rig.submit(EnableRequest{});
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->enabled; }, 1s));
  const auto move = rig.submit(MoveRelativeRequest{.distance = 1});  // waits
  rig.run_until([&] { return enable->has_ended(); }, 2s);
  EXPECT_EQ(enable->value().state, CommandState::done);
  EXPECT_GE(rig.world.now() - began, 300ms);
  EXPECT_EQ(rig.triggers(), 0) << "until the brake is open";
  EXPECT_TRUE(rig.run_until([&] { return move->has_ended(); }, 5s));
  EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
  began = rig.world.now();
  EXPECT_EQ(rig.complete(DisableRequest{}).state, CommandState::done);
  EXPECT_GE(rig.world.now() - began, 200ms);
}

TEST(M29, AnEdgeLiesBetweenTwoSamples) {
  Rig rig;
  rig.run(1s);
  const auto cursor = rig.machine->events().events_after(0, 1).newest;
  rig.run(37ms);
  const auto changed = rig.world.clock().wall(rig.world.now());
  rig.set_input("X5", true);
  rig.run(1s);
  const auto batch = rig.machine->events().events_after(cursor, 100);
  ASSERT_EQ(batch.events.size(), 1U);
  EXPECT_EQ(batch.events[0].axis, "feeder");
  const auto* edge = std::get_if<TerminalEdge>(&batch.events[0].content);
  ASSERT_NE(edge, nullptr);
  EXPECT_EQ(edge->terminal, "X5");
  EXPECT_TRUE(edge->active);
  EXPECT_LE(edge->after, changed);
  EXPECT_GE(edge->before, changed);
  EXPECT_LE(edge->before - edge->after, 500ms);
}

TEST(Eeprom, RestartsAndMovesWriteNothing) {
  for (const auto persist : {PersistSettings{}, PersistSettings::all(), PersistSettings{.terminals = true}})
    for_each_switch(
        {.adjust = [persist](AxisSettings& axis) { axis.persist = persist; }, .persistence = true},
        [](const RigOptions& options) {
          Rig rig(options);
          rig.ready();
          const auto counted = [&] { return rig.store.saved.axes["feeder"].eeprom_writes; };
          EXPECT_LE(rig.drive->eeprom_writes(), counted());
          const auto written = rig.drive->eeprom_writes();
          const auto shown = counted();
          for (int restart = 0; restart < 2; ++restart) {
            rig.stop_daemon();
            rig.start_daemon();
          }
          rig.enable();
          for (int move = 0; move < 20; ++move)
            rig.complete(MoveRelativeRequest{.distance = move % 2 == 0 ? 1.0 : -1.0});
          EXPECT_EQ(rig.complete(HomeRequest{}, 100s).state, CommandState::done);
          EXPECT_EQ(rig.drive->eeprom_writes(), written);
          EXPECT_EQ(counted(), shown);
          EXPECT_EQ(rig.state()->eeprom_writes, shown);
        });
}

}  // namespace
}  // namespace axisd::test
