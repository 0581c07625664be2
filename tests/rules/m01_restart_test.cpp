// M1: what a drive that was restarted may be told before a client has enabled it.
#include "config/fields.hpp"
#include "tests/rules/explain_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::HasSubstr;

/// Whoever switched it off may have done so to reach into the machine, and it comes up energised.
TEST(M01, ARestartedDriveStartsNothingUntilItIsEnabled) {
  both_directions({}, [](const RigOptions& options) {
    ExplainRig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    rig.cycle_power(10ms);
    ASSERT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 5s));
    rig.reconnect();
    ASSERT_TRUE(rig.state()->enabled);
    EXPECT_EQ(rig.state()->state, AxisState::standstill) << "as the drive is";
    rig.line->forget_wire();
    const auto starts = rig.drive->starts();
    const Action actions[] = {HomeRequest{}, MoveRelativeRequest{.distance = 1},
                              MoveAbsoluteRequest{.position = 1}, JogRequest{.velocity = 5},
                              MoveVelocityRequest{.velocity = 5}};
    for (const auto& action : actions) {
      EXPECT_THAT(rig.reasons(action), Contains("disabled")) << to_string(kind_of(action));
      EXPECT_EQ(rig.try_submit(action).error().reason, Reason::disabled) << to_string(kind_of(action));
    }
    EXPECT_THAT(rig.text(MoveRelativeRequest{.distance = 1}, Reason::disabled),
                HasSubstr("axisctl enable feeder"));
    rig.run(2s);
    EXPECT_EQ(rig.triggers(), 0);
    EXPECT_EQ(rig.drive->starts(), starts);
    rig.enable();
    EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 1}).state, CommandState::done);
  });
}

/// The drive was switched off and on while there was no daemon: wherever it had stood, and whether the
/// daemon had ended or had died.
TEST(M01, ARestartBetweenTwoRunsOfTheDaemonIsNoticed) {
  both_directions({.persistence = true, .journal = true}, [](const RigOptions& options) {
    for (const auto place : {0.0, 10.0})
      for (const bool killed : {false, true}) {
        SCOPED_TRACE(testing::Message() << place << " mm" << (killed ? ", killed" : ""));
        ExplainRig rig(options);
        rig.ready();
        EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
        EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = place}).state, CommandState::done);
        rig.run(1s);
        killed ? rig.kill_daemon() : rig.stop_daemon();
        rig.cycle_power(10ms);
        rig.idle(2s);
        rig.start_daemon();
        ASSERT_TRUE(rig.state()->enabled);
        EXPECT_THAT(rig.text(MoveRelativeRequest{.distance = 1}, Reason::disabled),
                    HasSubstr("switched off and on"));
        EXPECT_FALSE(rig.try_submit(MoveRelativeRequest{.distance = 1}));
        rig.enable();
        EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 1}).state, CommandState::done);
      }
  });
}

TEST(M01, ARestartBetweenTwoRunsIsNoticedOfAnAxisWithoutPosition) {
  Rig rig({.persistence = true, .journal = true});
  rig.enable();
  rig.stop_daemon();
  rig.cycle_power(10ms);
  rig.idle(2s);
  rig.start_daemon();
  const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("switched off and on"));
}

/// Also one in the midst of a motion, of which nobody had heard.
TEST(M01, ARestartInTheMidstOfAMotionOfADeadDaemonIsNoticed) {
  // By the canary that was kept with the position, or by the journal.
  for (const bool positioned : {true, false}) {
    Rig rig(
        {.adjust = [](AxisSettings& axis) { axis.jog_travel = 100; }, .persistence = true, .journal = true});
    positioned ? rig.ready() : rig.enable();
    rig.submit(MoveRelativeRequest{.distance = 100},
               {.client = "hmi", .request_id = positioned ? "" : "shift-7"});
    rig.run(500ms);
    rig.kill_daemon();
    rig.cycle_power(10ms);
    rig.idle(2s);
    rig.start_daemon();
    rig.complete(ResetRequest{});
    const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1});
    ASSERT_FALSE(refused) << positioned;
    EXPECT_THAT(refused.error().message, HasSubstr("switched off and on"));
  }
}

/// What one run of the daemon has noticed, the next one knows, until somebody enables the axis.
TEST(M01, ARestartIsNotForgottenWithTheRunThatNoticedIt) {
  for (const bool positioned : {false, true}) {
    Rig rig({.persistence = true, .journal = true});
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    rig.cycle_power(10ms);
    ASSERT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 5s));
    rig.reconnect();
    if (positioned) rig.complete(SetPositionRequest{.position = 5});
    for (int run = 0; run < 2; ++run) {
      run == 0 ? rig.stop_daemon() : rig.kill_daemon();
      rig.start_daemon();
      const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1});
      ASSERT_FALSE(refused) << run;
      EXPECT_EQ(refused.error().reason, Reason::disabled);
      EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    }
    rig.enable();
    rig.complete(SetPositionRequest{.position = 5});
    rig.stop_daemon();
    rig.start_daemon();
    EXPECT_EQ(rig.state()->trust, PositionTrust::restored);
    EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 1}).state, CommandState::done);
  }
}

/// Whenever a daemon ends or dies, its drive is not taken for one that was restarted.
TEST(M01, ADriveThatKeptItsPowerMayMoveAfterARestartOfTheDaemon) {
  for (const bool killed : {false, true})
    for (auto at = 0ms; at <= 1500ms; at += 31ms) {
      SCOPED_TRACE(testing::Message() << at.count() << " ms" << (killed ? ", killed" : ""));
      Rig rig({.persistence = true, .journal = true});
      rig.ready();
      EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
      rig.submit(MoveAbsoluteRequest{.position = 60});
      rig.run(at);
      killed ? rig.kill_daemon() : rig.stop_daemon();
      rig.idle(50ms);
      rig.start_daemon();
      rig.run(1s);
      if (rig.state()->state == AxisState::error_stop) rig.complete(ResetRequest{});
      const auto move = rig.complete(MoveRelativeRequest{.distance = 1});
      EXPECT_EQ(move.state, CommandState::done) << describe(move);
    }
}

/// The axis that comes after it would know nothing of the restart.
TEST(M01, ARestartedDriveIsNotGivenToAnotherAxisBeforeItIsEnabled) {
  Rig rig;
  rig.ready();
  EXPECT_TRUE(rig.axis().check_exchange(true).empty());
  rig.cycle_power(10ms);
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 5s));
  rig.reconnect();
  ASSERT_TRUE(rig.state()->enabled);
  const auto refused = rig.axis().check_exchange(true);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_THAT(refused[0].message, HasSubstr("switched off and on"));
  rig.enable();
  EXPECT_TRUE(rig.axis().check_exchange(true).empty());
}

void exchange(Rig& rig, const config::Configuration& wanted) {
  bool through = false;
  rig.machine->reload({.client = "fitter",
                       .configuration = wanted,
                       .changes = config::differences(rig.configuration, wanted)},
                      [&](const std::vector<Error>& refusals) {
                        EXPECT_TRUE(refusals.empty()) << to_string(refusals.front());
                        through = true;
                      });
  ASSERT_TRUE(rig.run_until([&] { return through; }, 5s));
}

/// The drive was switched off when its axis was exchanged, and comes back energised.
TEST(M01, ARestartBehindAnExchangeOfTheAxisIsNoticed) {
  Rig rig({.persistence = true, .journal = true});
  rig.enable();
  rig.drive->advance(rig.world.now());
  rig.drive->set_power(false);
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 20s));
  auto wanted = rig.configuration;
  wanted.axes.at(0).axis.limits.velocity = 50;
  exchange(rig, wanted);
  rig.drive->advance(rig.world.now());
  rig.drive->set_power(true);
  rig.reconnect();
  ASSERT_TRUE(rig.state()->enabled);
  const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("switched off and on"));
}

/// Also where this run of the daemon has not heard the drive yet, and the exchange costs the position.
TEST(M01, ARestartBehindAnExchangeBeforeTheDriveWasHeardIsNoticed) {
  for (const bool positioned : {false, true}) {
    SCOPED_TRACE(positioned);
    Rig rig({.persistence = true, .journal = true});
    positioned ? rig.ready() : rig.enable();
    rig.stop_daemon();
    rig.drive->advance(rig.world.now());
    rig.drive->set_power(false);
    rig.start_daemon(false);
    rig.run(3s);
    ASSERT_EQ(rig.state()->link, LinkState::offline);
    auto wanted = rig.configuration;
    wanted.axes.at(0).axis.scale.invert = true;
    exchange(rig, wanted);
    rig.drive->advance(rig.world.now());
    rig.drive->set_power(true);
    rig.reconnect();
    ASSERT_TRUE(rig.state()->enabled);
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1});
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("switched off and on"));
  }
}

/// Also where an exchange ends the one before it in the midst of a configuration.
TEST(M01, ADriveThatKeptItsPowerMayMoveAfterExchangesThatFollowEachOther) {
  for (auto at = 0ms; at <= 100ms; ++at) {
    SCOPED_TRACE(at.count());
    Rig rig({.persistence = true, .journal = true});
    rig.enable();
    for (const auto velocity : {50, 60}) {
      auto wanted = rig.configuration;
      wanted.axes.at(0).axis.limits.velocity = velocity;
      exchange(rig, wanted);
      rig.configuration = wanted;
      rig.run(velocity == 50 ? at : 0ms);
    }
    rig.reconnect();
    const auto moved = rig.try_submit(MoveRelativeRequest{.distance = 1});
    ASSERT_TRUE(moved) << moved.error().message;
  }
}

/// What had proven that the drive kept its memory is kept until there is something newer that does, also
/// where a run of the daemon never gets as far as to use the drive.
TEST(M01, ARestartBehindARunThatCouldNotConfigureIsNoticed) {
  enum class Before : std::uint8_t { nothing, energised, positioned };
  for (const auto before : {Before::nothing, Before::energised, Before::positioned})
    for (const bool restarted : {true, false}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(before) << (restarted ? ", restarted" : ""));
      Rig rig({.connect = before != Before::nothing, .persistence = true, .journal = true});
      if (before != Before::nothing) before == Before::energised ? rig.enable() : rig.ready();
      rig.stop_daemon();
      // A function that starts motion cannot be written to a drive that is energised.
      auto& inputs = rig.configuration.axes.at(0).axis.inputs;
      inputs.push_back({.terminal = "X4", .function = "jog_positive"});
      if (before == Before::nothing) rig.store.saved = {};
      rig.start_daemon(false);
      rig.run(3s);
      ASSERT_EQ(rig.state()->link, LinkState::configuring);
      rig.stop_daemon();
      inputs.pop_back();
      if (restarted) rig.cycle_power(10ms);
      rig.idle(2s);
      rig.start_daemon();
      ASSERT_TRUE(rig.state()->enabled);
      const auto move = rig.try_submit(MoveRelativeRequest{.distance = 1});
      ASSERT_EQ(move.has_value(), !restarted) << (move ? "" : move.error().message);
      if (!move) EXPECT_THAT(move.error().message, HasSubstr("switched off and on"));
    }
}

/// What ends with the daemon, as a quick stop that costs an open loop its position, takes back no more than
/// that.
TEST(M01, ARestartBehindAnEndInTheMidstOfAQuickStopIsNoticed) {
  for (auto at = 0ms; at <= 60ms; at += 4ms) {
    SCOPED_TRACE(at.count());
    Rig rig({.persistence = true, .journal = true});
    rig.ready();
    rig.submit(MoveAbsoluteRequest{.position = 100});
    rig.run(500ms);
    rig.submit(StopRequest{.kind = StopKind::quick_stop});
    rig.run(at);
    rig.stop_daemon();
    rig.cycle_power(10ms);
    rig.idle(2s);
    rig.start_daemon();
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    if (rig.state()->state == AxisState::error_stop) rig.complete(ResetRequest{});
    const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1});
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("switched off and on"));
  }
}

/// Nobody knows of a restart: it may have been energised, and at work, all the time.
TEST(M01, ADriveThatIsFoundEnergisedMayMove) {
  Rig rig;
  ASSERT_FALSE(rig.state()->enabled_by_us);
  EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 1}).state, CommandState::done);
}

}  // namespace
}  // namespace axisd::test
