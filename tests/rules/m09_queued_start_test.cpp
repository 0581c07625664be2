// What happens at a drive while its start waits for those of others on the line (M4, M6, M9, M21).
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>

#include "buses/start_turns.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// Starts of another axis: they keep the turn for seconds.
constexpr int many = 20;

/// A drive whose line is another one's for now.
class QueuedStart {
 public:
  explicit QueuedStart(RigOptions options) : rig(std::move(options)) {
    rig.ready();
    auto& turns = *rig.machine->find_bus("line-a")->start_turns();
    turn_ = turns.announce(many);
    spawn(rig.world.executor(), turns.take(turn_), "another axis");
    rig.run(1ms);
  }
  /// Submits, and waits until nothing but the turn is waited for.
  CommandPtr queue(const Action& action) {
    auto command = rig.submit(action);
    rig.run(100ms);
    EXPECT_EQ(rig.machine->find_bus("line-a")->start_turns()->waiting(), 1U);
    rig.line->forget_wire();
    return command;
  }
  /// The axis was just read; as it rests, what happens now is seen 200 ms later.
  void await_reading() {
    const auto last = rig.state()->sampled;
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->sampled.after() > last.after(); }, 1s));
    rig.run(10ms);
  }
  /// Later than a reading counts for a start, and sooner than the next one at rest.
  void others_are_done() {
    rig.run(120ms);
    turn_.leave();
  }
  /// Another master starts a motion at a constant velocity.
  void start_behind() {
    rig.write_behind(0x0023, 60);
    rig.write_behind(0x0027, 2);
  }

  Rig rig;

 private:
  StartTurns::Turn turn_;
};

constexpr MoveVelocityRequest onwards{.velocity = 20};
RigOptions endless(RigOptions options) {
  options.limits = false;
  return options;
}

TEST(M04, MotionThatNobodyAskedForIsStoppedWhileAStartWaits) {
  for (const Action& action : {Action{onwards}, Action{MoveAbsoluteRequest{.position = 10}}}) {
    both_directions({}, [&](const RigOptions& options) {
      QueuedStart queued(endless(options));
      auto& rig = queued.rig;
      const auto command = queued.queue(action);
      queued.start_behind();
      rig.run(1s);
      EXPECT_GE(rig.writes_of(0x0028), 1);
      EXPECT_FALSE(rig.drive->shaft_moving());
      EXPECT_EQ(command->value().state, CommandState::aborted) << describe(command->value());
      EXPECT_EQ(command->value().cause->reason, Reason::moving);
      EXPECT_EQ(command->value().cause->outcome, Outcome::not_sent);
      queued.others_are_done();
      rig.run(2s);
      EXPECT_EQ(rig.triggers(), 0);
    });
  }
}

TEST(M09, ADriveThatBeganToMoveSinceItsLastReadingIsNotStarted) {
  both_directions({}, [](const RigOptions& options) {
    for (const Action& action : {Action{onwards}, Action{HomeRequest{}}}) {
      QueuedStart queued(endless(options));
      auto& rig = queued.rig;
      const auto command = queued.queue(action);
      queued.await_reading();
      queued.start_behind();
      queued.others_are_done();
      rig.run(2s);
      EXPECT_EQ(rig.triggers(), 0) << describe(command->value());
      EXPECT_TRUE(command->has_ended());
      EXPECT_EQ(command->value().cause->reason, Reason::moving) << describe(command->value());
      EXPECT_FALSE(rig.drive->shaft_moving());
    }
  });
}

TEST(M21, HomingIsNotStartedOnASwitchThatItReachedWhileItWaited) {
  both_directions({}, [](const RigOptions& options) {
    QueuedStart queued(options);
    auto& rig = queued.rig;
    const auto homing = queued.queue(HomeRequest{});
    const auto terminal =
        std::ranges::find(rig.configuration.axes.front().axis.inputs, "home", &TerminalSettings::function)
            ->terminal;
    queued.await_reading();
    rig.set_input(terminal, true);
    queued.others_are_done();
    rig.run(2s);
    EXPECT_EQ(rig.triggers(), 0) << describe(homing->value());
    EXPECT_EQ(homing->value().state, CommandState::error);
    EXPECT_EQ(homing->value().cause->reason, Reason::limit_switch) << describe(homing->value());
    EXPECT_EQ(rig.state()->trust, PositionTrust::set);
  });
}

/// Homing backs off first: that was executed.
TEST(M21, AStopWhileHomingWaitsBehindItsBackoffTellsOfIt) {
  Rig rig;
  rig.ready();
  rig.set_input("X0", true);
  rig.run(300ms);
  const auto homing = rig.submit(HomeRequest{});
  ASSERT_TRUE(rig.run_until([&] { return homing->value().state == CommandState::active; }, 1s));
  rig.set_input("X0", false);
  auto& turns = *rig.machine->find_bus("line-a")->start_turns();
  auto turn = turns.announce(many);
  spawn(rig.world.executor(), turns.take(turn), "another axis");
  ASSERT_TRUE(rig.run_until([&] { return turns.waiting() == 1; }, 20s)) << describe(homing->value());
  rig.complete(StopRequest{});
  EXPECT_EQ(homing->value().state, CommandState::aborted);
  EXPECT_EQ(homing->value().cause->outcome, Outcome::unknown) << describe(homing->value());
  turn.leave();
  rig.run(1s);
}

}  // namespace
}  // namespace axisd::test
