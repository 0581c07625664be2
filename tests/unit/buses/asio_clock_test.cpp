#include "buses/asio_clock.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

namespace axisd {
namespace {

using namespace std::chrono_literals;

class AsioClocks : public ::testing::Test {
 protected:
  std::function<void()> note(int what) {
    return [this, what] { called.push_back(what); };
  }
  void run_until_called(std::size_t times) {
    while (called.size() < times) ASSERT_EQ(io.run_one(), 1U) << "nothing wakes it";
    io.restart();
  }

  boost::asio::io_context io;
  std::vector<int> called;
};

TEST_F(AsioClocks, CallsInOrderOfTimeWhateverTheOrderOfAsking) {
  AsioClock clock(io);
  const auto now = clock.now();
  const auto last = clock.call_at(now + 3ms, note(3));
  const auto first = clock.call_at(now - 1s, note(1));
  const auto middle = clock.call_at(now + 2ms, note(2));
  auto never = clock.call_at(now + 1ms, note(4));
  never.reset();
  run_until_called(3);
  EXPECT_EQ(called, (std::vector{1, 2, 3}));
}

TEST_F(AsioClocks, WakesForWhatACallbackAsksFor) {
  AsioClock clock(io);
  Clock::Timer next;
  const auto later = clock.call_at(clock.now() + 1h, note(3));
  const auto first = clock.call_at(clock.now(), [&] {
    called.push_back(1);
    next = clock.call_at(clock.now() + 1ms, note(2));
  });
  run_until_called(2);
  EXPECT_EQ(called, (std::vector{1, 2}));
}

TEST_F(AsioClocks, ServedByALoopCallsNothingByItself) {
  AsioClock clock(io, AsioClock::Served::by_loop);
  const auto at = clock.now();
  const auto due = clock.call_at(at, note(1));
  const auto later = clock.call_at(at + 1ms, note(2));
  EXPECT_EQ(io.poll(), 0U);
  EXPECT_FALSE(clock.serve(at - 1ns));
  EXPECT_TRUE(clock.serve(at));
  EXPECT_EQ(called, std::vector{1});
  clock.wake_in_time();
  io.restart();
  EXPECT_EQ(io.run_one(), 1U);  // wakes, and leaves the rest to the loop
  EXPECT_EQ(called, std::vector{1});
  EXPECT_TRUE(clock.serve(at + 1ms));
  EXPECT_EQ(called, (std::vector{1, 2}));
}

/// What is put off by a callback that went away wakes once too often, and then in time again.
TEST_F(AsioClocks, WakesInTimeAfterAnEarlierCallbackWasCancelled) {
  AsioClock clock(io);
  auto earlier = clock.call_at(clock.now() + 1ms, note(1));
  const auto later = clock.call_at(clock.now() + 5ms, note(2));
  earlier.reset();
  run_until_called(1);
  EXPECT_EQ(called, std::vector{2});
}

}  // namespace
}  // namespace axisd
