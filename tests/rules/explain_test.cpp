// Explain: the right list in constructed situations. Each is also held against what is really refused
// (ExplainRig).
#include <fmt/format.h>

#include "tests/rules/explain_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const Action move = MoveAbsoluteRequest{.position = 10};
const Action step = MoveRelativeRequest{.distance = 5};

TEST(Explain, NothingStandsInTheWayOfAnAxisThatIsReady) {
  ExplainRig rig;
  rig.ready();
  EXPECT_THAT(rig.reasons(std::nullopt), IsEmpty());
  for (const auto& action : every_action()) {
    EXPECT_THAT(rig.reasons(action), IsEmpty()) << to_string(kind_of(action));
    const auto command = rig.submit(action);
    rig.run(1s);
    EXPECT_NE(command->value().state, CommandState::error) << describe(command->value());
    rig.complete(StopRequest{});
    rig.ready();
  }
  EXPECT_THAT(rig.reasons(DisableRequest{}), IsEmpty());
}

TEST(Explain, ADisabledAxisHasLostItsPositionToo) {
  ExplainRig rig;
  rig.ready();
  rig.complete(DisableRequest{});
  EXPECT_THAT(rig.reasons(move), ElementsAre("disabled", "not_trusted"));
  EXPECT_THAT(rig.reasons(std::nullopt), ElementsAre("disabled", "(not_trusted)"));
  EXPECT_THAT(rig.text(move, Reason::disabled), HasSubstr("axisctl enable feeder"));
  EXPECT_THAT(rig.text(move, Reason::not_trusted),
              AllOf(HasSubstr("axisctl home feeder"), HasSubstr("axisctl set-position feeder")));
  EXPECT_THAT(rig.reasons(EnableRequest{}), IsEmpty());
  EXPECT_THAT(rig.reasons(SetPositionRequest{.position = 3}), ElementsAre("disabled"));
}

TEST(Explain, AnAlarmComesWithItsRemedyFromTheModelsTable) {
  ExplainRig rig;
  rig.ready();
  rig.drive->raise_alarm(2);
  rig.run(1s);
  const auto* spec = find_alarm(rig.axis().descriptor(), 2);
  ASSERT_NE(spec, nullptr);
  EXPECT_THAT(rig.reasons(EnableRequest{}), ElementsAre("alarm"));
  EXPECT_THAT(rig.text(EnableRequest{}, Reason::alarm),
              AllOf(HasSubstr("in ErrorStop"), HasSubstr("alarm 2 ("), HasSubstr(std::string(spec->remedy)),
                    HasSubstr("axisctl reset feeder")));
  EXPECT_THAT(rig.reasons(ResetRequest{}), IsEmpty()) << "the drive says whether its cause is gone";
}

TEST(Explain, ResetNamesAnAlarmThatOnlyThePowerSupplyEnds) {
  ExplainRig rig;
  rig.ready();
  rig.drive->raise_alarm(5);
  rig.run(1s);
  EXPECT_THAT(rig.reasons(ResetRequest{}), ElementsAre("alarm"));
  EXPECT_THAT(rig.text(ResetRequest{}, Reason::alarm), HasSubstr("only a power cycle ends"));
}

TEST(Explain, ATargetBeyondALimitComesWithThePermittedRange) {
  ExplainRig rig;
  rig.ready();
  const auto found = rig.explain(MoveAbsoluteRequest{.position = 500});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].error.reason, Reason::soft_limit);
  ASSERT_TRUE(found[0].error.permitted);
  EXPECT_EQ(found[0].error.permitted->minimum, 0);
  EXPECT_EQ(found[0].error.permitted->maximum, 400);
  EXPECT_THAT(rig.reasons(MoveRelativeRequest{.distance = -5}), ElementsAre("soft_limit"));
  EXPECT_THAT(rig.reasons(MoveVelocityRequest{.velocity = -5}), ElementsAre("soft_limit"));
}

TEST(Explain, EveryValueThatIsOutOfRangeIsNamed) {
  ExplainRig rig;
  rig.ready();
  const auto found = rig.explain(MoveAbsoluteRequest{
      .position = 500, .with = {.velocity = 5000, .acceleration_time = 1h, .deceleration_time = 2h}});
  ASSERT_EQ(found.size(), 4U);
  for (const auto* value : {"velocity 5000", "acceleration time", "deceleration time"})
    EXPECT_TRUE(std::ranges::any_of(found, [&](const Obstacle& obstacle) {
      return obstacle.error.reason == Reason::out_of_range && obstacle.error.message.starts_with(value) &&
             obstacle.error.permitted;
    })) << value;
  EXPECT_EQ(found[3].error.reason, Reason::soft_limit);
}

TEST(Explain, TheLeaseOfAnotherComesWithItsNameAndItsTime) {
  ExplainRig rig;
  rig.ready();
  const auto grant =
      rig.machine->leases().acquire({.client = "hmi", .label = "panel 2", .axes = {"feeder"}, .ttl = 2s});
  rig.run(500ms);
  EXPECT_THAT(rig.reasons(move, {.client = "b"}), ElementsAre("lease_required"));
  EXPECT_THAT(rig.text(move, Reason::lease_required, {.client = "b"}),
              AllOf(HasSubstr("hmi (panel 2)"), HasSubstr("for another 1.5 s"),
                    HasSubstr("axisctl lease acquire feeder --take")));
  EXPECT_THAT(rig.reasons(move, {.client = "hmi", .lease_token = grant->lease.token}), IsEmpty());
  EXPECT_THAT(rig.reasons(DisableRequest{}, {.client = "b"}), IsEmpty());
}

TEST(Explain, AStaleTokenIsSaidToBeOne) {
  ExplainRig rig;
  rig.ready();
  const auto grant = rig.machine->leases().acquire({.client = "hmi", .axes = {"feeder"}, .ttl = 1s});
  rig.run(2s);
  EXPECT_THAT(rig.reasons(move, {.client = "hmi", .lease_token = grant->lease.token}),
              ElementsAre("lease_lost"));
  EXPECT_THAT(rig.text(move, Reason::lease_lost, {.client = "hmi", .lease_token = grant->lease.token}),
              AllOf(HasSubstr("expired 1.0 s ago"), HasSubstr("axisctl lease acquire feeder")));
}

TEST(Explain, ControlLeasedNeedsALeaseThoughNobodyHasOne) {
  ExplainRig rig;
  rig.stop_daemon();
  rig.configuration.leases.required = true;
  rig.start_daemon();
  EXPECT_THAT(rig.reasons(EnableRequest{}, {.client = "a"}), ElementsAre("lease_required"));
  EXPECT_THAT(rig.text(EnableRequest{}, Reason::lease_required, {.client = "a"}),
              AllOf(HasSubstr("control: leased"), HasSubstr("axisctl lease acquire feeder")));
}

TEST(Explain, StopAllComesWithItsRelease) {
  ExplainRig rig;
  rig.ready();
  rig.machine->stop_all("hmi");
  EXPECT_THAT(rig.reasons(move), ElementsAre("inhibited", "stopping")) << "the stop itself, too";
  rig.run(2s);
  EXPECT_THAT(rig.reasons(move), ElementsAre("inhibited"));
  EXPECT_THAT(rig.text(move, Reason::inhibited), HasSubstr("axisctl release-stop --all"));
  EXPECT_THAT(rig.reasons(EnableRequest{}), IsEmpty()) << "it moves nothing";
}

TEST(Explain, AHeldStopComesWithItsRelease) {
  ExplainRig rig;
  rig.ready();
  rig.complete(StopRequest{.hold = true});
  EXPECT_THAT(rig.reasons(move), ElementsAre("stopping"));
  EXPECT_THAT(rig.text(move, Reason::stopping), HasSubstr("axisctl release-stop feeder"));
}

TEST(Explain, AnAxisThatStopsIsWaitedFor) {
  ExplainRig rig;
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(1s);
  rig.submit(StopRequest{});
  EXPECT_THAT(rig.reasons(move), ElementsAre("stopping"));
  EXPECT_THAT(rig.reasons(step), ElementsAre("stopping", "moving"));
  EXPECT_THAT(rig.reasons(ResetRequest{}), ElementsAre("stopping"));
}

TEST(Explain, AMotionInProgressDelaysSomeAndForbidsOthers) {
  ExplainRig rig;
  rig.ready();
  const auto running = rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(500ms);
  EXPECT_THAT(rig.reasons(move), ElementsAre("(moving)"));
  EXPECT_THAT(rig.text(move, Reason::moving),
              AllOf(HasSubstr("move_absolute " + running->value().id), HasSubstr("ends Aborted")));
  EXPECT_THAT(rig.reasons(step), ElementsAre("moving"));
  EXPECT_THAT(rig.reasons(EnableRequest{}), ElementsAre("moving"));
  EXPECT_THAT(rig.reasons(ResetRequest{}), ElementsAre("busy"));
  EXPECT_THAT(rig.reasons(SetPositionRequest{.position = 3}), ElementsAre("moving"));
  rig.submit(move);
  EXPECT_EQ(running->value().state, CommandState::aborted) << "as was said";
}

TEST(Explain, ACommandThatEndsAsUnknownLeavesAResetThatReadsBack) {
  ExplainRig rig;
  rig.ready();
  const auto lost = rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(500ms);
  rig.line->network().set_connected(false);
  ASSERT_TRUE(rig.run_until([&] { return lost->has_ended(); }, 5s));
  ASSERT_EQ(lost->value().state, CommandState::unknown);
  EXPECT_THAT(rig.reasons(move), ElementsAre("fault", "offline", "no_reply", "(stopping)"))
      << "a stop is owed";
  EXPECT_THAT(rig.text(move, Reason::offline),
              AllOf(HasSubstr("feeder: offline: "), HasSubstr("check power, wiring, address and baud rate"),
                    Not(HasSubstr("check power and wiring")), HasSubstr("it is retried by itself")));
  rig.line->network().set_connected(true);
  rig.reconnect();
  rig.run(3s);
  EXPECT_THAT(rig.reasons(step), ElementsAre("fault"));
  EXPECT_THAT(rig.text(step, Reason::fault),
              AllOf(HasSubstr("unknown"), HasSubstr("axisctl reset feeder, which reads the drive back")));
  EXPECT_THAT(rig.reasons(ResetRequest{}), IsEmpty());
}

TEST(Explain, AnActiveLimitSwitchForbidsItsDirectionOnly) {
  ExplainRig rig;
  rig.ready();
  rig.set_input("X1", true);
  rig.run(1s);
  rig.complete(SetPositionRequest{.position = 200});
  EXPECT_THAT(rig.reasons(MoveAbsoluteRequest{.position = 210}), ElementsAre("limit_switch"));
  EXPECT_THAT(rig.text(MoveAbsoluteRequest{.position = 210}, Reason::limit_switch),
              HasSubstr("axisctl jog feeder -VELOCITY"));
  EXPECT_THAT(rig.reasons(MoveAbsoluteRequest{.position = 190}), IsEmpty());
  EXPECT_THAT(rig.reasons(JogRequest{.velocity = 5}), ElementsAre("limit_switch"));
  EXPECT_THAT(rig.reasons(std::nullopt), ElementsAre("(limit_switch)"));
}

TEST(Explain, HomingOnAnActiveSwitchNeedsABackoff) {
  ExplainRig rig({.adjust = [](AxisSettings& axis) { axis.homing->backoff.reset(); }});
  rig.ready();
  rig.set_input("X0", true);
  rig.run(1s);
  EXPECT_THAT(rig.reasons(HomeRequest{}), ElementsAre("limit_switch"));
  EXPECT_THAT(rig.text(HomeRequest{}, Reason::limit_switch), HasSubstr("home switch is already active"));
}

TEST(Explain, HomingThatIsNotConfiguredIsNoRemedyEither) {
  ExplainRig rig({.adjust = [](AxisSettings& axis) { axis.homing.reset(); }});
  rig.enable();
  EXPECT_THAT(rig.reasons(HomeRequest{}), ElementsAre("not_supported"));
  EXPECT_THAT(rig.text(move, Reason::not_trusted), ::testing::Not(HasSubstr("axisctl home")));
}

TEST(Explain, WhatAnAxisWithoutAPositionMayDo) {
  ExplainRig rig;
  rig.enable();
  EXPECT_THAT(rig.reasons(move), ElementsAre("not_trusted"));
  EXPECT_THAT(rig.reasons(MoveRelativeRequest{.distance = 50}), ElementsAre("not_trusted"));
  EXPECT_EQ(rig.explain(MoveRelativeRequest{.distance = 50})[0].error.permitted->maximum, 10) << "jog_travel";
  EXPECT_THAT(rig.reasons(step), IsEmpty());
  EXPECT_THAT(rig.reasons(MoveVelocityRequest{.velocity = 5}), ElementsAre("not_trusted"));
  EXPECT_THAT(rig.reasons(JogRequest{.velocity = 5}), IsEmpty());
  EXPECT_THAT(rig.reasons(std::nullopt), ElementsAre("(not_trusted)"));
  EXPECT_THAT(rig.text(std::nullopt, Reason::not_trusted), HasSubstr("absolute moves are refused"));
}

TEST(Explain, WhereTrustIsWaivedAbsoluteMovesAreNotCalledRefused) {
  ExplainRig rig({.adjust = [](AxisSettings& axis) { axis.require_trust = false; }});
  rig.enable();
  ASSERT_EQ(rig.state()->trust, PositionTrust::unknown);
  EXPECT_THAT(rig.reasons(std::nullopt), ElementsAre("(not_trusted)"));
  EXPECT_THAT(
      rig.text(std::nullopt, Reason::not_trusted),
      AllOf(HasSubstr("absolute moves and limits go by what the drive counts"), Not(HasSubstr("refused"))));
  EXPECT_THAT(rig.reasons(move), IsEmpty());
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 2}).state, CommandState::done);
}

TEST(Explain, PowerOnItsWayIsWaitedFor) {
  ExplainRig rig;
  rig.enable();
  rig.submit(DisableRequest{});
  rig.run(1ms);
  EXPECT_THAT(rig.reasons(HomeRequest{}), ::testing::Contains("disabled"));
  EXPECT_THAT(rig.text(HomeRequest{}, Reason::disabled), HasSubstr("being disabled"));
  rig.run(1s);
  rig.submit(EnableRequest{});
  EXPECT_THAT(rig.reasons(HomeRequest{}), ElementsAre("(disabled)")) << "it waits for that";
  EXPECT_THAT(rig.text(HomeRequest{}, Reason::disabled), HasSubstr("being enabled"));
  EXPECT_THAT(rig.reasons(JogRequest{.velocity = 5}), ::testing::Contains("disabled"));
  EXPECT_THAT(rig.reasons(EnableRequest{}), ElementsAre("busy"));
}

TEST(Explain, AReleaseThatALostLeaseOwesIsWaitedFor) {
  ExplainRig rig({.adjust = [](AxisSettings& axis) { axis.on_lease_loss = LeaseLoss::disable; }});
  rig.ready();
  const auto grant = rig.machine->leases().acquire({.client = "hmi", .axes = {"feeder"}, .ttl = 1s});
  rig.submit(MoveAbsoluteRequest{.position = 300}, {.client = "hmi", .lease_token = grant->lease.token});
  rig.run(1050ms);
  EXPECT_THAT(rig.reasons(HomeRequest{}, {.client = "b"}), ElementsAre("stopping", "busy", "disabled"));
  EXPECT_THAT(rig.text(HomeRequest{}, Reason::busy, {.client = "b"}), HasSubstr("because a lease ended"));
}

TEST(Explain, ATerminalThatMovesTheDriveIsNamed) {
  ExplainRig rig({.switches = {{"enabled_at_power_up", false}}, .adjust = [](AxisSettings& axis) {
                    axis.inputs.insert(axis.inputs.end(), {{.terminal = "X3", .function = "pt_enable"},
                                                           {.terminal = "X4", .function = "pin0"}});
                    axis.segments =
                        SegmentSettings{.positions = {{.number = 1, .target = 100, .velocity = 20}}};
                  }});
  rig.enable();
  rig.set_input("X4", true);
  rig.run(50ms);
  rig.set_input("X3", true);
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->motion_cause == MotionCause::terminal; }, 1s));
  EXPECT_THAT(rig.reasons(JogRequest{.velocity = 5}), ElementsAre("terminal"));
  EXPECT_THAT(rig.text(JogRequest{.velocity = 5}, Reason::terminal), HasSubstr("axisctl stop feeder"));
}

TEST(Explain, ATerminalThatHoldsTheDriveIsWorthKnowing) {
  ExplainRig rig({.adjust = [](AxisSettings& axis) {
    axis.inputs.push_back({.terminal = "X3", .function = "quick_stop"});
  }});
  rig.ready();
  rig.set_input("X3", true);
  rig.run(1s);
  EXPECT_THAT(rig.reasons(JogRequest{.velocity = 5}), ::testing::Contains("(terminal)"));
  EXPECT_THAT(rig.text(JogRequest{.velocity = 5}, Reason::terminal), HasSubstr("X3 (quick_stop) is active"));
}

TEST(Explain, ARequestThatIsTooOldIsRefusedForThat) {
  ExplainRig rig;
  rig.ready();
  EXPECT_THAT(rig.reasons(move, {.not_after = rig.world.now()}), ElementsAre("expired"));
}

TEST(Explain, WhatMayWaitIsLookedAtFromWhereItWillStart) {
  ExplainRig rig;
  rig.ready();
  const CommandOptions buffered{.buffer_mode = BufferMode::buffered};
  EXPECT_THAT(rig.reasons(step, buffered), IsEmpty());
  EXPECT_THAT(rig.reasons(JogRequest{.velocity = 5}, buffered), ElementsAre("not_supported"));
  rig.submit(MoveAbsoluteRequest{.position = 398});
  rig.run(500ms);
  EXPECT_THAT(rig.reasons(MoveRelativeRequest{.distance = 1}, buffered), IsEmpty()) << "it waits";
  EXPECT_THAT(rig.reasons(step, buffered), ElementsAre("soft_limit")) << "398 mm and 5 mm";
  for (int i = 0; i < 16; ++i) rig.submit(MoveRelativeRequest{.distance = -1}, buffered);
  EXPECT_THAT(rig.reasons(step, buffered), ElementsAre("busy"));
  EXPECT_THAT(rig.text(step, Reason::busy, buffered), HasSubstr("16 commands wait already"));
}

TEST(Explain, ARenewalOfAJogIsNotANewStart) {
  ExplainRig rig;
  rig.ready();
  const CommandOptions options{.client = "a"};
  rig.submit(JogRequest{.velocity = 20, .hold = 2s}, options);
  rig.run(500ms);
  EXPECT_THAT(rig.reasons(JogRequest{.velocity = 20, .hold = 2s}, options), IsEmpty());
  EXPECT_THAT(rig.reasons(JogRequest{.velocity = 30, .hold = 2s}, options), ElementsAre("(moving)"));
}

TEST(Explain, AfterALostJournalEachCommandWithAnIdIsRefusedForAWhile) {
  ExplainRig rig({.persistence = true, .journal = true});
  rig.ready();
  rig.stop_daemon();
  rig.journal.text = "lost";
  rig.start_daemon();
  int asked = 0;
  const auto next = [&] {
    return CommandOptions{.client = "hmi", .request_id = fmt::format("r{}", ++asked)};
  };
  for (const auto& action : every_action()) {
    const auto found = rig.axis().explain(action, next());
    ASSERT_FALSE(found.empty());
    EXPECT_TRUE(found.front().blocking);
    const auto refused = rig.try_submit(action, next());
    ASSERT_FALSE(refused);
    EXPECT_EQ(to_string(found.front().error), to_string(refused.error()));
    EXPECT_EQ(refused.error().reason, Reason::storage);
    EXPECT_THAT(refused.error().message, HasSubstr("requests are refused for another "));
    EXPECT_THAT(refused.error().remedy, HasSubstr("look at the machine; ask again in "));
  }
  const auto any = rig.axis().explain(std::nullopt, {});
  ASSERT_FALSE(any.empty());
  EXPECT_EQ(any.front().error.reason, Reason::storage);
  EXPECT_TRUE(rig.machine->doubt());
  EXPECT_THAT(rig.axis().explain(DisableRequest{}, next()), IsEmpty()) << "never taken for a repeat";
  EXPECT_EQ(rig.complete(StopRequest{}).state, CommandState::done);

  rig.run(longest_validity);
  EXPECT_FALSE(rig.machine->doubt());
  EXPECT_THAT(rig.axis().explain(EnableRequest{}, next()), IsEmpty());
  EXPECT_TRUE(rig.try_submit(EnableRequest{}, next()));
}

TEST(Explain, EverythingAtOnceIsAllTold) {
  ExplainRig rig;
  rig.ready();
  const auto grant = rig.machine->leases().acquire({.client = "hmi", .axes = {"feeder"}, .ttl = 60s});
  ASSERT_TRUE(grant);
  rig.complete(StopRequest{.hold = true});
  rig.complete(DisableRequest{});
  rig.machine->stop_all("hmi");
  rig.run(2s);
  rig.drive->raise_alarm(2);
  rig.run(1s);
  rig.line->network().set_connected(false);
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 5s));
  rig.run(1s);
  const auto request = MoveAbsoluteRequest{.position = 10, .with = {.velocity = 5000}};
  EXPECT_THAT(rig.reasons(request, {.client = "b"}),
              ElementsAre("inhibited", "lease_required", "stopping", "alarm", "offline", "no_reply",
                          "disabled", "not_trusted", "out_of_range"));
}

}  // namespace
}  // namespace axisd::test
