#include "devices/axis/earlier_run.hpp"

#include <gtest/gtest.h>

#include "tests/support/virtual_world.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = EarlierRun::State;
using Position = EarlierRun::Position;

constexpr TimePoint settle_by{25s};

class EarlierRunTest : public testing::Test {
 protected:
  CommandPtr command() { return std::make_shared<CommandRecord>(Command{}, world_.clock()); }

  test::VirtualWorld world_;
  EarlierRun earlier_;
};

TEST_F(EarlierRunTest, ItIsOpenUntilTheLastOfItsCommandsHasEnded) {
  EXPECT_EQ(earlier_.state(), State::settled);
  const auto first = command(), second = command();
  earlier_.take_over({{.command = first, .note = {}}, {.command = second, .note = {}}}, settle_by);
  EXPECT_EQ(earlier_.state(), State::open);
  first->done();
  earlier_.drop_ended();
  ASSERT_EQ(earlier_.commands().size(), 1U);
  EXPECT_EQ(earlier_.commands().front().command, second);
  second->done();
  earlier_.drop_ended();
  EXPECT_EQ(earlier_.state(), State::settled);
}

TEST_F(EarlierRunTest, AllAreTakenTogether) {
  earlier_.take_over({{.command = command(), .note = {}}}, settle_by);
  EXPECT_EQ(earlier_.take_all().size(), 1U);
  EXPECT_EQ(earlier_.state(), State::settled);
}

TEST_F(EarlierRunTest, WhatIsOpenIsOverdueOnceItsTimeHasPassed) {
  EXPECT_FALSE(earlier_.overdue(settle_by)) << "nothing is open";
  earlier_.take_over({{.command = command(), .note = {}}}, settle_by);
  EXPECT_FALSE(earlier_.overdue(settle_by - 1ms));
  EXPECT_TRUE(earlier_.overdue(settle_by));
}

TEST_F(EarlierRunTest, ASavedPositionIsTriedOnceAndMayBeDoubtedBefore) {
  EXPECT_EQ(earlier_.position(), Position::saved);
  earlier_.doubt();
  EXPECT_EQ(earlier_.position(), Position::doubtful);
  earlier_.tried();
  EXPECT_EQ(earlier_.position(), Position::tried);
  earlier_.doubt();
  EXPECT_EQ(earlier_.position(), Position::tried);
}

}  // namespace
}  // namespace axisd
