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

TEST_F(CommandBookTest, IdsAreRememberedInBoundedNumber) {
  Error refused;
  int accepted = 0;
  for (; accepted < 200'000; ++accepted) {
    const auto id = fmt::format("n{}", accepted);
    if (const auto found = book_.find_repeat("x", move, request(id)); !found) {
      refused = found.error();
      break;
    }
    book_.open("x", move, request(id))->done();
  }
  EXPECT_EQ(accepted, 100'000);
  EXPECT_EQ(refused.reason, Reason::busy);
  EXPECT_NE(repeat("n0"), nullptr) << "those are still known";
  pass(minutes(31));
  EXPECT_EQ(repeat("new"), nullptr) << "accepted again";
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
