// Commands over restarts of the daemon: nothing moves twice, and nothing is said that is not so.
#include <gmock/gmock.h>

#include <variant>
#include <vector>

#include "tests/rules/operate.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

RigOptions with_journal() {
  return {.adjust = [](AxisSettings& axis) { axis.jog_travel = 50; }, .persistence = true, .journal = true};
}

CommandOptions request(const std::string& id) { return {.client = "hmi", .request_id = id}; }

/// Repeats the request until it is answered by a command, and waits for its end.
Command repeat(Rig& rig, const Action& action, const std::string& id) {
  std::optional<CommandPtr> command;
  const bool answered = rig.run_until(
      [&] {
        if (auto result = rig.try_submit(action, request(id))) command = *result;
        return command.has_value();
      },
      seconds(30));
  EXPECT_TRUE(answered) << "refused all the time";
  if (!command) return {};
  EXPECT_TRUE(rig.run_until([&] { return (*command)->has_ended(); }, seconds(60))) << "does not end";
  return (*command)->value();
}

/// Kills the daemon at any moment of a relative move; the client repeats the call with the same id.
void kill_at_each_moment(const MoveRelativeRequest& move, double start_mm, milliseconds from, milliseconds to,
                         milliseconds step) {
  int done = 0, not_executed = 0, in_part = 0;
  for (auto at = from; at <= to; at += step) {
    SCOPED_TRACE(at.count());
    Rig rig(with_journal());
    rig.ready();
    if (start_mm != 0)
      ASSERT_EQ(rig.complete(MoveAbsoluteRequest{.position = start_mm}).state, CommandState::done);
    rig.run(milliseconds(300));
    const auto before = rig.load_mm();
    (void)rig.submit(move, request("r1"));
    rig.run(at);
    rig.kill_daemon();
    rig.idle(milliseconds(50));
    rig.start_daemon();
    const auto command = repeat(rig, move, "r1");
    rig.run(seconds(1));
    const auto moved = rig.load_mm() - before;
    switch (command.state) {
      case CommandState::done:
        ++done;
        EXPECT_NEAR(moved, move.distance, 0.02) << describe(command);
        break;
      case CommandState::aborted:
        if (command.cause->outcome == Outcome::not_executed) {
          ++not_executed;
          EXPECT_NEAR(moved, 0, 0.001) << describe(command);
        } else {
          ++in_part;
          EXPECT_GT(std::abs(moved), 0.005) << describe(command);
          EXPECT_LT(std::abs(moved), std::abs(move.distance) - 0.005) << describe(command);
          EXPECT_THAT(command.cause->message, HasSubstr("in part"));
        }
        break;
      default:
        ADD_FAILURE() << "the drive can be read: " << describe(command);
    }
    // Whatever it was: asked for again it is the same.
    EXPECT_EQ(repeat(rig, move, "r1").id, command.id);
    EXPECT_NEAR(rig.load_mm() - before, moved, 0.001);
  }
  EXPECT_GT(done + in_part, 0);
  if (from == milliseconds(0)) EXPECT_GT(not_executed, 0);
}

TEST(Restart, AMoveThatADeadDaemonBeganHappensOnceAtMost) {
  kill_at_each_moment({.distance = 8}, 0, milliseconds(0), milliseconds(40), milliseconds(1));
  kill_at_each_moment({.distance = 8}, 0, milliseconds(40), milliseconds(900), milliseconds(43));
}

TEST(Restart, AlsoWhereItEndsOrBeginsAtTheCountOfAPowerUp) {
  kill_at_each_moment({.distance = -20}, 20, milliseconds(0), milliseconds(30), milliseconds(1));
  kill_at_each_moment({.distance = -20}, 20, milliseconds(30), milliseconds(1200), milliseconds(97));
}

TEST(Restart, TheEndOfWhatADeadDaemonBeganIsAnEvent) {
  Rig rig(with_journal());
  rig.ready();
  const MoveRelativeRequest move{.distance = 8};
  (void)rig.submit(move, request("r1"));
  rig.run(milliseconds(100));
  rig.kill_daemon();
  rig.start_daemon();
  const auto command = repeat(rig, move, "r1");
  std::vector<Command> told;
  for (const auto& event : rig.machine->events().events_after(0, 1'000).events)
    if (const auto* change = std::get_if<CommandChange>(&event.content)) told.push_back(*change->command);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].id, command.id);
  EXPECT_EQ(told[0].state, command.state);
}

TEST(Restart, WhatWasDoneIsToldAndNotDoneAgain) {
  Rig rig(with_journal());
  rig.ready();
  const MoveRelativeRequest move{.distance = 5};
  const auto first = repeat(rig, move, "r1");
  EXPECT_EQ(first.state, CommandState::done);
  for (int restart = 0; restart < 2; ++restart) {
    restart == 0 ? rig.kill_daemon() : rig.stop_daemon();
    rig.start_daemon();
    const auto again = repeat(rig, move, "r1");
    EXPECT_EQ(again.id, first.id);
    EXPECT_EQ(again.state, CommandState::done);
    EXPECT_EQ(again.granted.velocity, first.granted.velocity);
    EXPECT_EQ(again.ended_at, first.ended_at);
    EXPECT_EQ(rig.machine->book().find(first.id)->value().state, CommandState::done);
    EXPECT_EQ(rig.triggers(), 0);
    const auto other = rig.try_submit(MoveRelativeRequest{.distance = 6}, request("r1"));
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().reason, Reason::request_id_conflict);
  }
  EXPECT_NEAR(rig.load_mm(), 5, 0.02);
}

TEST(Restart, WhatHadNotBeenSentIsAbortedAndNeverSent) {
  Rig rig(with_journal());
  rig.ready();
  const auto first = rig.submit(MoveAbsoluteRequest{.position = 100}, request("r1"));
  rig.run(milliseconds(500));
  // This one waits for the halt of the first.
  (void)rig.submit(MoveAbsoluteRequest{.position = 0}, request("r2"));
  rig.kill_daemon();
  rig.start_daemon();
  const auto second = repeat(rig, MoveAbsoluteRequest{.position = 0}, "r2");
  EXPECT_EQ(second.state, CommandState::aborted);
  EXPECT_EQ(second.cause->outcome, Outcome::not_executed);
  EXPECT_EQ(rig.triggers(), 0);
  EXPECT_EQ(rig.state()->state, AxisState::standstill) << "the moving drive was stopped";
}

TEST(Restart, NothingIsSentBeforeItIsDurable) {
  Rig rig(with_journal());
  rig.ready();
  const auto triggers = rig.triggers();
  rig.journal.slow = true;
  const auto move = rig.submit(MoveRelativeRequest{.distance = 5}, request("r1"));
  rig.run(seconds(1));
  EXPECT_EQ(rig.triggers(), triggers);
  EXPECT_EQ(move->value().state, CommandState::accepted);
  rig.journal.release();
  EXPECT_TRUE(rig.run_until([&] { return move->has_ended(); }, seconds(10)));
  EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
  EXPECT_EQ(rig.triggers(), triggers + 1);
}

TEST(Restart, AStopNeverWaitsForTheDiskAndWhatItEndedIsNeverSent) {
  Rig rig(with_journal());
  rig.ready();
  const auto triggers = rig.triggers();
  rig.journal.slow = true;
  const auto move = rig.submit(MoveRelativeRequest{.distance = 5}, request("r1"));
  rig.run(milliseconds(50));
  const auto stop = rig.complete(StopRequest{}, seconds(2));
  EXPECT_EQ(stop.state, CommandState::done);
  EXPECT_EQ(move->value().state, CommandState::aborted);
  rig.journal.release();
  rig.run(seconds(2));
  EXPECT_EQ(rig.triggers(), triggers);
  // A restart knows it, too.
  rig.kill_daemon();
  rig.start_daemon();
  EXPECT_EQ(repeat(rig, MoveRelativeRequest{.distance = 5}, "r1").state, CommandState::aborted);
  EXPECT_EQ(rig.triggers(), 0);
}

TEST(Restart, AFullDiskRefusesWhatIsNewAndNothingElse) {
  Rig rig(with_journal());
  rig.ready();
  rig.journal.failing = true;
  const auto before = rig.triggers();
  // The first one to find out.
  const auto first = repeat(rig, MoveRelativeRequest{.distance = 1}, "r2");
  ASSERT_EQ(first.state, CommandState::error);
  EXPECT_EQ(first.cause->reason, Reason::storage);
  EXPECT_EQ(first.cause->outcome, Outcome::not_sent);
  EXPECT_EQ(rig.triggers(), before);
  rig.journal.failing = false;
  EXPECT_EQ(repeat(rig, MoveRelativeRequest{.distance = 1}, "r2").id, first.id) << "its id was used";
  const auto move = rig.submit(MoveRelativeRequest{.distance = 50}, request("r1"));
  rig.run(milliseconds(300));
  rig.journal.failing = true;
  EXPECT_EQ(rig.complete(StopRequest{.kind = StopKind::halt}).state, CommandState::done);
  EXPECT_EQ(move->value().state, CommandState::aborted);
  const auto triggers = rig.triggers();
  const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1}, request("r3"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::storage);
  EXPECT_THAT(refused.error().message, HasSubstr("journal.v1"));
  EXPECT_FALSE(refused.error().remedy.empty());
  EXPECT_EQ(rig.triggers(), triggers);
  EXPECT_EQ(rig.complete(StopRequest{}).state, CommandState::done);
  EXPECT_EQ(rig.complete(DisableRequest{}).state, CommandState::done);
  rig.journal.failing = false;
  EXPECT_EQ(repeat(rig, EnableRequest{}, "r4").state, CommandState::done);
}

TEST(Restart, AnUnknownOutcomeStaysInErrorStopUntilReset) {
  Rig rig(with_journal());
  rig.ready();
  (void)rig.submit(MoveRelativeRequest{.distance = 40}, request("r1"));
  rig.run(milliseconds(300));
  rig.kill_daemon();
  rig.cycle_power(milliseconds(10));
  rig.idle(seconds(3));
  rig.start_daemon();
  const auto lost = repeat(rig, MoveRelativeRequest{.distance = 40}, "r1");
  EXPECT_EQ(lost.state, CommandState::unknown) << describe(lost);
  for (int restart = 0; restart < 2; ++restart) {
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    EXPECT_FALSE(rig.try_submit(EnableRequest{}, request("e" + std::to_string(restart))));
    rig.kill_daemon();
    rig.start_daemon();
    EXPECT_EQ(rig.first_write(0x0028) >= 0, true) << "a stop first";
    EXPECT_EQ(repeat(rig, MoveRelativeRequest{.distance = 40}, "r1").id, lost.id);
  }
  EXPECT_EQ(repeat(rig, ResetRequest{}, "reset").state, CommandState::done);
  rig.kill_daemon();
  rig.start_daemon();
  EXPECT_NE(rig.state()->state, AxisState::error_stop);
}

TEST(Restart, ADriveThatCannotBeReadLeavesTheOutcomeUnknown) {
  Rig rig(with_journal());
  rig.ready();
  (void)rig.submit(MoveRelativeRequest{.distance = 40}, request("r1"));
  rig.run(milliseconds(300));
  rig.kill_daemon();
  rig.drive->set_power(false);
  rig.start_daemon(false);
  const auto lost = repeat(rig, MoveRelativeRequest{.distance = 40}, "r1");
  EXPECT_EQ(lost.state, CommandState::unknown);
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
}

TEST(Restart, AStillMovingDriveIsToldToStopBeforeAnythingElse) {
  Rig rig(with_journal());
  rig.ready();
  (void)rig.submit(MoveRelativeRequest{.distance = 200}, request("r1"));
  rig.run(milliseconds(800));
  rig.kill_daemon();
  rig.start_daemon();
  EXPECT_EQ(rig.first_write(0x0028), 0) << "index of the first frame";
  const auto move = repeat(rig, MoveRelativeRequest{.distance = 200}, "r1");
  EXPECT_EQ(move.state, CommandState::aborted);
  EXPECT_EQ(move.cause->outcome, Outcome::unknown) << "never 'not executed' for what ran";
}

TEST(Restart, WithinTheToleranceTheStartProvesNothing) {
  auto options = with_journal();
  options.adjust = [](AxisSettings& axis) {
    axis.jog_travel = 50;
    axis.position_tolerance = 0.1;
  };
  Rig rig(options);
  rig.ready();
  rig.journal.slow = true;
  (void)rig.submit(MoveRelativeRequest{.distance = 0.05}, request("r1"));
  rig.run(milliseconds(10));
  rig.journal.release();  // durable, but nothing was sent yet
  rig.kill_daemon();
  rig.start_daemon();
  const auto move = repeat(rig, MoveRelativeRequest{.distance = 0.05}, "r1");
  EXPECT_EQ(move.state, CommandState::unknown) << describe(move);
}

TEST(Restart, RenewalsOfAJogBelongToItAlsoAfterACrash) {
  Rig rig(with_journal());
  rig.ready();
  const JogRequest jog{.velocity = 5, .hold = milliseconds(300)};
  const auto first = rig.submit(jog, request("r0"));
  rig.run(milliseconds(100));
  const auto durable = rig.journal.durable;
  for (int i = 1; i <= 10; ++i) {
    rig.run(milliseconds(150));
    EXPECT_EQ(rig.submit(jog, request("r" + std::to_string(i))), first);
  }
  EXPECT_EQ(rig.journal.durable, durable) << "a renewal is no start";
  EXPECT_FALSE(first->has_ended());
  rig.kill_daemon();
  rig.start_daemon();
  const auto at = rig.load_mm();
  for (const auto* id : {"r0", "r7", "r10"}) EXPECT_EQ(repeat(rig, jog, id).id, first->value().id);
  rig.run(seconds(1));
  EXPECT_EQ(rig.triggers(), 0);
  EXPECT_NEAR(rig.load_mm(), at, 0.001);
}

TEST(Restart, ARenewalThatIsNotKnownToARestartDoesNotCount) {
  Rig rig(with_journal());
  rig.ready();
  const JogRequest jog{.velocity = 5, .hold = milliseconds(300)};
  const auto first = rig.submit(jog, request("r0"));
  rig.run(milliseconds(200));
  rig.journal.slow = true;
  EXPECT_EQ(rig.submit(jog, request("r1")), first);
  EXPECT_TRUE(rig.run_until([&] { return first->has_ended(); }, milliseconds(300)));
  rig.journal.release();
  rig.run(seconds(1));
  EXPECT_FALSE(rig.state()->moving);
}

TEST(Restart, DamageRefusesWhatItMayHaveLost) {
  Rig rig(with_journal());
  rig.ready();
  const MoveRelativeRequest move{.distance = 5};
  const auto known = repeat(rig, move, "r1");
  EXPECT_EQ(repeat(rig, move, "r2").state, CommandState::done);
  rig.kill_daemon();
  rig.journal.text.resize(rig.journal.text.find(" accepted", rig.journal.text.find("request=r1")) + 20);
  rig.journal.text += "\n";
  for (int restart = 0; restart < 2; ++restart) {
    rig.start_daemon();
    const auto lost = rig.try_submit(move, request("r2"));
    ASSERT_FALSE(lost) << "it was executed";
    EXPECT_EQ(lost.error().reason, Reason::storage);
    EXPECT_EQ(lost.error().outcome, Outcome::unknown);
    EXPECT_THAT(lost.error().remedy, HasSubstr("ask again in "));
    EXPECT_EQ(repeat(rig, move, "r1").id, known.id) << "what is there is known";
    EXPECT_EQ(rig.complete(StopRequest{}).state, CommandState::done);
    if (restart == 0) rig.kill_daemon();
  }
  rig.run(longest_validity + seconds(1));
  EXPECT_EQ(repeat(rig, move, "r3").state, CommandState::done);
  EXPECT_NEAR(rig.load_mm(), 15, 0.02);
}

TEST(Restart, APositionIsForgottenBeforeItsCounterIsZeroed) {
  auto options = with_journal();
  options.adjust_drive = [](simulation::SimulatedNodeSettings& node) { node.mechanics = {}; };
  options.adjust = [](AxisSettings& axis) {
    axis.scale = {.pulses_per_revolution = 4000, .travel_numerator = 360, .modulo = 360, .unit = "deg"};
    axis.limits.position_minimum.reset();
    axis.limits.position_maximum.reset();
    axis.limits.velocity = 18000;
    axis.homing.reset();
    axis.poll_moving = seconds(20);  // the long way takes hours
    axis.inputs.clear();
  };
  Rig rig(options);
  rig.ready();
  const double nearly = ((1 << 30) - 500) / 4000.0 * 360;
  ASSERT_EQ(rig.complete(MoveRelativeRequest{.distance = nearly}, std::chrono::hours(100)).state,
            CommandState::done);
  rig.run(seconds(1));
  ASSERT_TRUE(rig.store.saved.axes["feeder"].offset);
  (void)rig.submit(MoveRelativeRequest{.distance = 360}, request("r1"));
  EXPECT_TRUE(rig.run_until([&] { return rig.writes_of(0x002C) > 0; }, seconds(5)));
  EXPECT_FALSE(rig.store.saved.axes["feeder"].offset) << "it would fit again where the counter comes by";
  rig.kill_daemon();
  rig.idle(seconds(5));
  rig.start_daemon();
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
}

TEST(Restart, OtherCommandsAreToldByWhatTheDriveShows) {
  Rig rig(with_journal());
  (void)rig.submit(EnableRequest{}, request("e1"));
  EXPECT_TRUE(rig.run_until([&] { return rig.writes_of(0x0019) > 0 || rig.state()->enabled; }, seconds(2)));
  rig.run(milliseconds(20));
  rig.kill_daemon();
  rig.start_daemon();
  EXPECT_EQ(repeat(rig, EnableRequest{}, "e1").state, CommandState::done);

  EXPECT_EQ(repeat(rig, SetPositionRequest{.position = 7}, "s1").state, CommandState::done);
  rig.kill_daemon();
  rig.start_daemon();
  EXPECT_EQ(repeat(rig, SetPositionRequest{.position = 7}, "s1").state, CommandState::done);
  EXPECT_NEAR(rig.state()->position, 7, 1e-9);

  // Homing zeroes the counter: from elsewhere it shows that it has begun.
  EXPECT_EQ(repeat(rig, MoveRelativeRequest{.distance = 20}, "m1").state, CommandState::done);
  (void)rig.submit(HomeRequest{}, request("h1"));
  rig.run(milliseconds(700));
  rig.kill_daemon();
  rig.idle(seconds(20));
  rig.start_daemon();
  const auto homed = repeat(rig, HomeRequest{}, "h1");
  EXPECT_EQ(homed.state, CommandState::aborted) << describe(homed);
  EXPECT_EQ(homed.cause->outcome, Outcome::unknown);
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown) << "whatever was saved before";
}

}  // namespace
}  // namespace axisd::test
