// BufferMode Buffered: what waits for the command before it (PLCopen part 1).
#include <gmock/gmock.h>

#include <vector>

#include "tests/rules/leased_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

CommandOptions buffered(std::string request_id = {}) {
  return {.client = "a", .request_id = std::move(request_id), .buffer_mode = BufferMode::buffered};
}

CommandPtr wait_behind(Rig& rig, const Action& action) { return rig.submit(action, buffered()); }

bool all_ended(const std::vector<CommandPtr>& commands) {
  return std::ranges::all_of(commands, [](const auto& command) { return command->has_ended(); });
}

void expect_never_sent(const CommandPtr& command, Reason reason = Reason::superseded) {
  const auto& value = command->value();
  EXPECT_EQ(value.state, CommandState::aborted) << describe(value);
  ASSERT_TRUE(value.cause);
  EXPECT_EQ(value.cause->reason, reason) << describe(value);
  EXPECT_EQ(value.cause->outcome, Outcome::not_sent);
  EXPECT_FALSE(value.started_at);
}

/// A move to 300 mm under way, with two behind it: to 100 mm and 50 mm on from there.
struct Waiting {
  explicit Waiting(Rig& rig)
      : first(rig.submit(MoveAbsoluteRequest{.position = 300})),
        second(wait_behind(rig, MoveAbsoluteRequest{.position = 100})),
        third(wait_behind(rig, MoveRelativeRequest{.distance = 50})) {
    rig.run(500ms);
    EXPECT_EQ(first->value().state, CommandState::active);
    EXPECT_EQ(second->value().state, CommandState::accepted);
    rig.line->forget_wire();
  }
  CommandPtr first, second, third;
};

TEST(Buffered, StartsWhenTheOneBeforeIsDone) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const Waiting waiting(rig);
    EXPECT_EQ(waiting.second->value().granted.position, 100);
    EXPECT_EQ(waiting.third->value().granted.position, 150);
    EXPECT_EQ(waiting.third->value().granted.distance, 50);
    bool at_rest_between = false;
    ASSERT_TRUE(rig.run_until(
        [&] {
          at_rest_between =
              at_rest_between || (rig.state()->state == AxisState::standstill && !waiting.third->has_ended());
          return waiting.third->has_ended();
        },
        20s));
    for (const auto& command : {waiting.first, waiting.second, waiting.third})
      EXPECT_EQ(command->value().state, CommandState::done) << describe(command->value());
    EXPECT_GE(*waiting.second->value().started_at, *waiting.first->value().ended_at);
    EXPECT_GE(*waiting.third->value().started_at, *waiting.second->value().ended_at);
    EXPECT_EQ(rig.load_mm(), 150);
    EXPECT_EQ(rig.triggers(), 2);
    EXPECT_EQ(rig.writes_of(0x0028), 0) << "nothing was stopped for it";
    EXPECT_FALSE(at_rest_between);
  });
}

TEST(Buffered, ThirdsAddUp) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    std::vector<CommandPtr> commands = {rig.submit(MoveRelativeRequest{.distance = 10.0 / 3})};
    for (int i = 0; i < 8; ++i)
      commands.push_back(wait_behind(rig, MoveRelativeRequest{.distance = 10.0 / 3}));
    EXPECT_TRUE(rig.run_until([&] { return all_ended(commands); }, 60s));
    EXPECT_EQ(rig.load_mm(), 30);
  });
}

TEST(Buffered, BehindAHomingThePositionIsKnown) {
  Rig rig;
  rig.enable();
  const auto home = rig.submit(HomeRequest{});
  const auto move = wait_behind(rig, MoveAbsoluteRequest{.position = 20});
  const auto velocity = wait_behind(rig, MoveVelocityRequest{.velocity = -30});
  ASSERT_TRUE(rig.run_until([&] { return velocity->value().state == CommandState::active; }, 60s));
  EXPECT_EQ(home->value().state, CommandState::done);
  EXPECT_EQ(move->value().state, CommandState::done);
  EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
  EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 1}, buffered()).error().reason, Reason::busy)
      << "behind what has no end of its own nothing would ever start";
}

TEST(Buffered, NothingBeforeItItStartsAtOnce) {
  Rig rig;
  rig.ready();
  const auto move = wait_behind(rig, MoveAbsoluteRequest{.position = 5});
  rig.run(2s);
  EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
}

TEST(Buffered, WhateverEndsTheOneBeforeEndsItToo) {
  using Event = std::function<void(Rig&)>;
  const Event events[] = {
      [](Rig& rig) { rig.submit(StopRequest{.kind = StopKind::halt}); },
      [](Rig& rig) { rig.submit(StopRequest{}); },
      [](Rig& rig) { rig.submit(StopRequest{.kind = StopKind::quick_stop}); },
      [](Rig& rig) { rig.submit(DisableRequest{}); },
      [](Rig& rig) { rig.machine->stop_all("b"); },
      [](Rig& rig) { rig.submit(MoveAbsoluteRequest{.position = 310}); },
      [](Rig& rig) { rig.set_input("X1", true); },  // the positive limit
      [](Rig& rig) { rig.cycle_power(300ms); },
      [](Rig& rig) { rig.fault({.kind = simulation::FaultKind::drop_request, .count = -1}); },
  };
  int which = 0;
  for (const auto& event : events) {
    SCOPED_TRACE(which++);
    Rig rig;
    rig.ready();
    const Waiting waiting(rig);
    event(rig);
    rig.run(15s);
    ASSERT_TRUE(waiting.first->has_ended());
    EXPECT_NE(waiting.first->value().state, CommandState::done);
    expect_never_sent(waiting.second);
    expect_never_sent(waiting.third);
    EXPECT_THAT(waiting.third->value().cause->message, HasSubstr("what it waited for was not done"));
    EXPECT_NE(rig.load_mm(), 100);
    EXPECT_NE(rig.load_mm(), 150);
  }
}

TEST(Buffered, CancelledItTakesThoseBehindItAlong) {
  Rig rig;
  rig.ready();
  const Waiting waiting(rig);
  const auto fourth = wait_behind(rig, MoveRelativeRequest{.distance = 1});
  EXPECT_TRUE(rig.axis().cancel(waiting.third));
  expect_never_sent(waiting.third, Reason::cancelled);
  expect_never_sent(fourth);
  rig.run(20s);
  EXPECT_EQ(waiting.first->value().state, CommandState::done);
  EXPECT_EQ(waiting.second->value().state, CommandState::done);
  EXPECT_EQ(rig.load_mm(), 100);
}

TEST(Buffered, IsRefusedByWhereTheOneBeforeWillEnd) {
  Rig rig;
  rig.ready();
  const Waiting waiting(rig);  // it will stand at 150 mm of 400
  const auto beyond = rig.try_submit(MoveRelativeRequest{.distance = 251}, buffered());
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().reason, Reason::soft_limit);
  EXPECT_TRUE(rig.try_submit(MoveRelativeRequest{.distance = 250}, buffered()));
  EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = -1}, buffered()).error().reason,
            Reason::soft_limit);
  EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = NAN}, buffered()).error().reason,
            Reason::invalid_argument);
  EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 5, .with = {.velocity = 101}}, buffered())
                .error()
                .reason,
            Reason::out_of_range);
}

TEST(Buffered, OnlyWhatEndsByItselfAndNotWithoutBound) {
  Rig rig;
  rig.ready();
  for (const Action& action : {Action(JogRequest{.velocity = 5}), Action(ResetRequest{}),
                               Action(SetPositionRequest{}), Action(EnableRequest{})})
    EXPECT_EQ(rig.try_submit(action, buffered()).error().reason, Reason::not_supported);
  const auto first = rig.submit(MoveAbsoluteRequest{.position = 300});
  for (int i = 0; i < 16; ++i) wait_behind(rig, MoveAbsoluteRequest{.position = 1.0 + i});
  const auto refusal = rig.try_submit(MoveAbsoluteRequest{.position = 50}, buffered());
  ASSERT_FALSE(refusal);
  EXPECT_EQ(refusal.error().reason, Reason::busy);
  EXPECT_THAT(refusal.error().message, HasSubstr("16 commands wait"));
  EXPECT_EQ(rig.try_submit(MoveVelocityRequest{.velocity = 5, .hold = 300ms}, buffered()).error().reason,
            Reason::busy);
}

TEST(Buffered, ItsValidityGoesOnWhileItWaits) {
  Rig rig;
  rig.ready();
  const auto first = rig.submit(MoveAbsoluteRequest{.position = 390});
  auto options = buffered();
  options.not_after = rig.world.now() + 1s;
  const auto late = rig.submit(MoveAbsoluteRequest{.position = 10}, options);
  const auto behind = wait_behind(rig, MoveAbsoluteRequest{.position = 20});
  rig.run(20s);
  EXPECT_EQ(first->value().state, CommandState::done);
  expect_never_sent(late, Reason::expired);
  expect_never_sent(behind);
  EXPECT_EQ(rig.load_mm(), 390);
}

TEST(Buffered, ARepeatAttachesToIt) {
  Rig rig;
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 300});
  const auto move = rig.submit(MoveRelativeRequest{.distance = 10}, buffered("once"));
  EXPECT_EQ(rig.submit(MoveRelativeRequest{.distance = 10}, buffered("once")), move);
  rig.run(20s);
  EXPECT_EQ(rig.submit(MoveRelativeRequest{.distance = 10}, buffered("once")), move);
  EXPECT_EQ(move->value().state, CommandState::done);
  EXPECT_EQ(rig.load_mm(), 310);
}

TEST(Buffered, FinishLetsNothingBehindStart) {
  LeasedRig rig(LeaseLoss::finish);
  std::uint64_t token = 0;
  const auto move = rig.move_under_lease(token);
  auto options = buffered();
  options.lease_token = token;
  const auto waiting = rig.submit(MoveAbsoluteRequest{.position = 10}, options);
  rig.run(10s);
  EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
  expect_never_sent(waiting, Reason::lease_lost);
  EXPECT_EQ(rig.load_mm(), 390);
}

}  // namespace
}  // namespace axisd::test
