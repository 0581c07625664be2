#include "devices/axis/command_book.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/fake_journal.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd {
namespace {

using std::chrono::minutes;

CommandOptions request(const std::string& id) { return {.client = "hmi", .request_id = id}; }
const Action move = MoveRelativeRequest{.distance = 1};

class CommandBookTest : public testing::Test {
 protected:
  void pass(Duration time) { world_.run_for(time); }
  /// Enters others, which is when old ones are forgotten.
  void enter_others(int count) {
    for (int i = 0; i < count; ++i)
      book_.open("y", move, request(fmt::format("other {}", ++others_)))->done();
  }
  CommandPtr repeat(const std::string& id) { return book_.find_repeat("x", move, request(id)).value(); }

  test::VirtualWorld world_;
  CommandBook book_{world_.clock(), "i"};
  int others_ = 0;
};

TEST_F(CommandBookTest, AnIdIsKeptForLongAfterItsCommandEnded) {
  const auto command = book_.open("x", move, request("a"));
  pass(minutes(90));
  enter_others(100);
  EXPECT_EQ(repeat("a"), command) << "it has not ended";
  command->done();
  pass(minutes(29));
  enter_others(100);
  EXPECT_EQ(book_.find(command->value().id), command);
  EXPECT_EQ(repeat("a"), command) << "which counts as being heard of";
  pass(minutes(29));
  enter_others(100);
  EXPECT_EQ(repeat("a"), command);
  pass(minutes(61));
  enter_others(200);
  EXPECT_EQ(repeat("a"), nullptr);
  EXPECT_EQ(book_.find(command->value().id), nullptr);
}

TEST_F(CommandBookTest, WhatLivesLongHoldsUpNothing) {
  const auto endless = book_.open("x", move, request("endless"));
  const auto old = book_.open("x", move, request("old"));
  old->done();
  pass(minutes(31));
  enter_others(1);
  EXPECT_EQ(repeat("old"), nullptr);
  EXPECT_EQ(repeat("endless"), endless);
}

TEST_F(CommandBookTest, FurtherRequestsOfACommandAreKeptLikewise) {
  const auto command = book_.open("x", move, request("a"));
  pass(minutes(40));
  book_.attach(command, "x", move, request("b"), [](const Result<void>&) {});
  command->done();
  pass(minutes(20));
  enter_others(50);
  EXPECT_EQ(repeat("b"), command);
  EXPECT_EQ(repeat("a"), command);
}

/// Asks as axes do; the commands end at once.
class SharesTest : public testing::Test {
 protected:
  static CommandOptions of(const std::string& client, const std::string& id) {
    return {.client = client, .request_id = id};
  }
  Result<CommandPtr> ask(const std::string& client, const std::string& id) {
    auto found = book_.find_repeat("x", move, of(client, id));
    if (!found || *found) return found;
    auto command = book_.open("x", move, of(client, id));
    command->done();
    return command;
  }
  /// How many new ids are taken; `refused_` says why not more.
  int fill(const std::string& client, int most = 100'000) {
    for (int i = 0; i < most; ++i) {
      auto taken = ask(client, fmt::format("{} {}", client, next_++));
      if (taken) continue;
      refused_ = taken.error();
      return i;
    }
    return most;
  }
  void pass(Duration time) { world_.run_for(time); }

  test::VirtualWorld world_;
  CommandBook book_{world_.clock(), "i", nullptr, {.total = 30'000}};
  int next_ = 0;
  Error refused_;
};

TEST_F(SharesTest, OneClientLeavesRoomForTheOthers) {
  EXPECT_EQ(fill("greedy"), 20'000);
  EXPECT_EQ(refused_.reason, Reason::busy);
  EXPECT_EQ(refused_.outcome, Outcome::not_sent);
  EXPECT_EQ(
      refused_.message,
      "greedy has 20000 request ids remembered, the most that it may have while 20000 of 30000 are in use");
  EXPECT_TRUE(refused_.remedy.starts_with("the next is free in 660 s; ")) << refused_.remedy;
  EXPECT_TRUE(refused_.remedy.contains("server.limits.request_ids")) << refused_.remedy;
  EXPECT_TRUE(ask("hmi", "enable"));
  EXPECT_EQ(fill("second"), 6'666);
  EXPECT_EQ(fill("third"), 2'222);
  EXPECT_FALSE(ask("greedy", "more"));
  EXPECT_TRUE(ask("hmi", "move"));
  for (int i = 0; i < 8; ++i) EXPECT_GE(fill(fmt::format("late {}", i)), 300) << i;
  EXPECT_LE(book_.ids(), 33'000);
}

TEST_F(SharesTest, RepeatsAreAnsweredWhereNothingNewIsTaken) {
  const auto first = ask("greedy", "first").value();
  fill("greedy");
  pass(minutes(10));
  const auto again = ask("greedy", "first");
  ASSERT_TRUE(again);
  EXPECT_EQ((*again)->value().id, first->value().id) << "it was not executed again";
  EXPECT_EQ((*again)->value().state, CommandState::done);
  EXPECT_EQ((*again)->value().asked.distance, 1);
  EXPECT_EQ((*again)->value().client, "greedy");
  const auto other = book_.find_repeat("x", MoveRelativeRequest{.distance = 2}, of("greedy", "first"));
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().reason, Reason::request_id_conflict);
  EXPECT_TRUE(ask("hmi", "first").value() != first) << "ids belong to their clients";
}

TEST_F(SharesTest, StopsNeedNoIds) {
  fill("greedy");
  for (int i = 0; i < 1'000; ++i) book_.open("x", StopRequest{}, {.client = "greedy"})->done();
  EXPECT_FALSE(ask("greedy", "more"));
}

TEST_F(SharesTest, OwnIdsGiveWayAfterElevenMinutesAndOthersNever) {
  fill("greedy", 10'000);
  EXPECT_TRUE(ask("hmi", "kept"));
  pass(minutes(5));
  EXPECT_EQ(fill("greedy"), 9'999) << "and one is of hmi";
  pass(minutes(5) + std::chrono::seconds(59));
  EXPECT_FALSE(ask("greedy", "more")) << "still within 11 minutes";
  EXPECT_TRUE(refused_.remedy.contains("free in"));
  pass(std::chrono::seconds(2));
  EXPECT_TRUE(ask("greedy", "more"));
  EXPECT_NE(book_.find_repeat("x", move, of("hmi", "kept")).value(), nullptr) << "no business of greedy's";
  // Those of the second batch were heard of 6 minutes ago.
  EXPECT_EQ((*ask("greedy", "greedy 10001"))->value().id, (*ask("greedy", "greedy 10001"))->value().id);
}

TEST_F(SharesTest, WithRoomIdsAreKeptForHalfAnHour) {
  const auto first = ask("hmi", "first").value()->value().id;
  pass(minutes(1));
  fill("other", 9'000);
  pass(minutes(28));
  EXPECT_EQ(ask("hmi", "first").value()->value().id, first);
  pass(minutes(29));
  fill("other", 100);
  EXPECT_EQ(ask("hmi", "first").value()->value().id, first) << "asking for it made it younger";
  pass(minutes(62));
  fill("other", 100);
  EXPECT_NE(ask("hmi", "first").value()->value().id, first);
}

/// What is not over is never forgotten, and does not end in a short memory.
TEST_F(SharesTest, OpenCommandsKeepAll) {
  const auto endless = book_.open("x", move, of("greedy", "endless"));
  fill("greedy");
  pass(minutes(12));
  fill("greedy");
  EXPECT_EQ(book_.find_repeat("x", move, of("greedy", "endless")).value(), endless);
  EXPECT_EQ(book_.find(endless->value().id), endless);
}

TEST(CommandBookRestart, SharesAndAgesGoOn) {
  test::VirtualWorld world;
  test::FakeJournal journal(world.executor(), &world.clock());
  const IdLimits limits{.total = 3'000};
  const auto of = [](const std::string& client, int i) {
    return CommandOptions{.client = client, .request_id = fmt::format("{}", i)};
  };
  std::string first;
  {
    CommandBook book(world.clock(), "1", &journal, limits);
    for (int i = 0; i < 2'000; ++i) {
      const auto command = book.open("x", move, of("greedy", i));
      if (i == 0) first = command->value().id;
      book.sending(command, {}, [](const Result<void>&) {});
      command->done();
    }
    EXPECT_FALSE(book.find_repeat("x", move, of("greedy", 2'000)));
    world.run_for(minutes(6));
  }
  for (int start = 2; start < 4; ++start) {
    journal.restart(world.clock().wall(world.now()));
    CommandBook book(world.clock(), std::to_string(start), &journal, limits);
    const auto refused = book.find_repeat("x", move, of("greedy", 2'000));
    ASSERT_FALSE(refused) << "a restart forgets nothing";
    EXPECT_TRUE(refused.error().remedy.starts_with(start == 2 ? "the next is free in 300 s"
                                                              : "the next is free in 60 s"))
        << "nor does it begin the time anew: " << refused.error().remedy;
    EXPECT_EQ(book.find_repeat("x", move, of("hmi", 1)).value(), nullptr);
    EXPECT_EQ(book.find_repeat("x", move, of("greedy", 0)).value()->value().id, first);
    world.run_for(minutes(4));
  }
  world.run_for(minutes(2));
  journal.restart(world.clock().wall(world.now()));
  CommandBook book(world.clock(), "4", &journal, limits);
  EXPECT_EQ(book.find_repeat("x", move, of("greedy", 2'000)).value(), nullptr);
}

/// A repeat that came before a restart counts after it, too.
TEST(CommandBookRestart, WhatWasAskedForAgainIsYounger) {
  test::VirtualWorld world;
  test::FakeJournal journal(world.executor(), &world.clock());
  std::string first;
  {
    CommandBook book(world.clock(), "1", &journal);
    const auto command = book.open("x", move, request("a"));
    first = command->value().id;
    command->abort({.reason = Reason::superseded});
    world.run_for(minutes(29));
    EXPECT_EQ(book.find_repeat("x", move, request("a")).value(), command);
    world.run_for(minutes(1));
  }
  journal.restart(world.clock().wall(world.now()));
  CommandBook book(world.clock(), "2", &journal);
  world.run_for(minutes(28));
  for (int i = 0; i < 100; ++i) (void)book.find_repeat("x", move, request(fmt::format("other {}", i)));
  const auto again = book.find_repeat("x", move, request("a")).value();
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->value().id, first);
  EXPECT_EQ(again->value().state, CommandState::aborted);
}

TEST_F(CommandBookTest, AJogThatIsRenewedWithNewIdsDoesNotFillTheMemory) {
  const Action jog = JogRequest{.velocity = 1};
  const auto command = book_.open("x", jog, request("first"));
  int taken = 0;
  while (taken < 20'000 && book_.find_repeat("x", jog, request(fmt::format("renewal {}", taken)))) {
    book_.attach(command, "x", jog, request(fmt::format("renewal {}", taken)), [](const auto&) {});
    ++taken;
  }
  EXPECT_GT(taken, 10'000);
  EXPECT_LT(taken, 20'000);
  const auto refused = book_.find_repeat("x", jog, request("another"));
  EXPECT_EQ(refused.error().reason, Reason::busy);
  EXPECT_EQ(book_.find_repeat("x", jog, request("renewal 7")).value(), command) << "a repeat is none";
  EXPECT_TRUE(book_.find_repeat("y", move, {.client = "panel", .request_id = "a"}));
  command->done();
  pass(std::chrono::minutes(31));
  for (int i = 0; i < 3'000; ++i)
    book_.open("y", move, {.client = "panel", .request_id = fmt::format("{}", i)})->done();
  EXPECT_TRUE(book_.find_repeat("x", jog, request("another"))) << "it has ended";
}

TEST_F(CommandBookTest, CommandsWithoutAnIdDoNotPileUp) {
  const auto first = book_.open("x", StopRequest{}, {});
  first->done();
  for (int i = 0; i < 20'000; ++i) book_.open("x", StopRequest{}, {})->done();
  EXPECT_EQ(book_.find(first->value().id), nullptr);
}

TEST(CommandBookRestart, OnlyTheLastStartOfAnAxisIsToldByReadingItBack) {
  test::VirtualWorld world;
  test::FakeJournal journal(world.executor());
  {
    CommandBook book(world.clock(), "1", &journal);
    for (const auto* id : {"a", "b"}) book.sending(book.open("x", move, request(id)), {}, {});
    (void)book.open("x", move, request("c"));
    book.sending(book.open("gone", move, request("d")), {}, {});
    journal.frozen = true;
  }
  journal.frozen = false;
  journal.restart(world.clock().wall(world.now()));
  CommandBook book(world.clock(), "2", &journal);
  const auto unsettled = book.take_unsettled("x");
  ASSERT_EQ(unsettled.size(), 2);
  EXPECT_FALSE(unsettled[0].tellable);
  EXPECT_TRUE(unsettled[1].tellable);
  EXPECT_EQ(book.find_repeat("x", move, request("c")).value()->value().cause->outcome, Outcome::not_executed);
  EXPECT_TRUE(book.take_unsettled("x").empty());
  book.give_up_unsettled();
  EXPECT_EQ(book.find_repeat("gone", move, request("d")).value()->value().state, CommandState::unknown);
}

}  // namespace
}  // namespace axisd
