#include "buses/start_turns.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/virtual_world.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;

class StartTurnsTest : public ::testing::Test {
 public:
  ~StartTurnsTest() override { world.run_for(10s); }  // no sequence outlives its turns
  /// Takes a turn, and keeps it for `takes`.
  void start(char name, Duration takes, int starts = 1) {
    auto sequence = [](StartTurnsTest& test, char who, Duration time, int count) -> Task<> {
      auto turn = test.turns.announce(count);
      co_await test.turns.take(turn);
      test.order += who;
      test.began.push_back(test.world.now() - test.begun);
      co_await sleep_until(test.world.executor(), test.world.clock(), test.world.now() + time);
      turn.done();
    };
    spawn(world.executor(), sequence(*this, name, takes, starts), "start");
  }

  test::VirtualWorld world;
  StartTurns turns{world.executor(), world.clock(), 10ms};
  TimePoint begun = world.now();
  std::string order;
  std::vector<Duration> began;
};

TEST_F(StartTurnsTest, WhoAsksWhileNobodyStartsBeginsAtOnce) {
  start('a', 10ms);
  world.run_for(0ms);
  EXPECT_EQ(order, "a");
  EXPECT_EQ(turns.waiting(), 0U);
}

TEST_F(StartTurnsTest, EachHasItsTurnInTheOrderOfAsking) {
  for (const char name : {'a', 'b', 'c'}) start(name, 10ms);
  world.run_for(0ms);
  EXPECT_EQ(turns.waiting(), 2U);
  world.run_for(1s);
  EXPECT_EQ(order, "abc");
  EXPECT_EQ(began, (std::vector<Duration>{0ms, 10ms, 20ms}));
}

TEST_F(StartTurnsTest, TellsOfHowManyStartsTheTurnIs) {
  EXPECT_EQ(turns.starts_of_turn(), 0);
  start('a', 10ms);
  start('b', 10ms, 3);
  world.run_for(5ms);
  EXPECT_EQ(turns.starts_of_turn(), 1);
  world.run_for(10ms);
  EXPECT_EQ(turns.starts_of_turn(), 3);
  world.run_for(10ms);
  EXPECT_EQ(turns.starts_of_turn(), 0);
}

TEST_F(StartTurnsTest, AfterTheLongestTimeOfAStartTheNextBegins) {
  start('a', 2s);
  start('b', 10ms);
  start('c', 10ms);
  world.run_for(3s);
  EXPECT_EQ(began, (std::vector<Duration>{0ms, StartTurns::longest_start, StartTurns::longest_start + 10ms}));
}

TEST_F(StartTurnsTest, AGroupHasTheTimeOfItsStarts) {
  start('a', 900ms, 2);
  start('b', 10ms);
  world.run_for(3s);
  EXPECT_EQ(began, (std::vector<Duration>{0ms, 900ms}));
}

TEST_F(StartTurnsTest, TheExpectedWaitIsThatOfAllStartsBefore) {
  start('a', 10ms);
  world.run_for(1s);
  EXPECT_EQ(turns.expected_wait(), 0ms);
  start('a', 10ms);
  start('b', 30ms, 3);
  start('c', 10ms);
  world.run_for(0ms);
  EXPECT_EQ(turns.expected_wait(), 50ms);
  world.run_for(15ms);
  EXPECT_EQ(turns.expected_wait(), 40ms);
  world.run_for(1s);
  EXPECT_EQ(turns.expected_wait(), 0ms);
}

TEST_F(StartTurnsTest, WhatIsAnnouncedIsExpectedAndKeepsNobodyWaiting) {
  auto announced = turns.announce();
  EXPECT_EQ(turns.expected_wait(), 10ms);
  start('b', 10ms);
  world.run_for(0ms);
  EXPECT_EQ(order, "b");
  announced.leave();
  world.run_for(1s);
  EXPECT_EQ(turns.expected_wait(), 0ms);
}

/// A stop came: it neither waits on, nor counts as a short start.
TEST_F(StartTurnsTest, WhoLeavesWaitsNoLonger) {
  start('a', 100ms);
  auto given_up = turns.announce();
  bool returned = false;
  auto sequence = [](StartTurnsTest& test, const StartTurns::Turn& turn, bool& done) -> Task<> {
    co_await test.turns.take(turn);
    done = true;
  };
  spawn(world.executor(), sequence(*this, given_up, returned), "start");
  start('c', 10ms);
  world.run_for(10ms);
  EXPECT_FALSE(returned);
  given_up.leave();
  world.run_for(0ms);
  EXPECT_TRUE(returned);
  EXPECT_EQ(turns.waiting(), 1U);
  EXPECT_EQ(turns.expected_wait(), 20ms);
  world.run_for(1s);
  EXPECT_EQ(began, (std::vector<Duration>{0ms, 100ms}));
}

/// A StopAll takes all of them from the queue, and each has its turn for a moment.
TEST_F(StartTurnsTest, StartsThatWereGivenUpTellNothing) {
  std::vector<StartTurns::Turn> given_up;
  given_up.reserve(16);
  for (int i = 0; i < 16; ++i) {
    given_up.push_back(turns.announce());
    spawn(world.executor(), turns.take(given_up.back()), "start");
  }
  world.run_for(0ms);
  given_up.clear();
  start('a', 10ms);
  start('b', 10ms);
  world.run_for(0ms);
  EXPECT_EQ(turns.expected_wait(), 20ms);
}

TEST_F(StartTurnsTest, WhoOverstaysIsNotWaitedForTwice) {
  start('a', 1s);
  world.run_for(600ms);
  EXPECT_EQ(turns.expected_wait(), 0ms);
  start('b', 10ms);
  world.run_for(10ms);
  EXPECT_EQ(order, "ab");
}

TEST_F(StartTurnsTest, ATurnThatIsMovedIsOneTurn) {
  auto sequence = [](StartTurnsTest& test) -> Task<> {
    auto announced = test.turns.announce();
    StartTurns::Turn kept;
    kept = std::move(announced);
    co_await test.turns.take(kept);
    std::vector<StartTurns::Turn> all;
    all.push_back(std::move(kept));
    co_await sleep_until(test.world.executor(), test.world.clock(), test.world.now() + 10ms);
    all.clear();
    co_await sleep_until(test.world.executor(), test.world.clock(), test.world.now() + 10ms);
  };
  spawn(world.executor(), sequence(*this), "start");
  start('b', 10ms);
  world.run_for(1s);
  EXPECT_EQ(began, (std::vector<Duration>{10ms}));
}

}  // namespace
}  // namespace axisd
