// Replies of a node whose pace the worker knows: part of the wait for them is slept through.
#include <gtest/gtest.h>

#include <atomic>

#include "buses/modbus_rtu/reply_pace.hpp"
#include "worker_bench.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace test;

/// A worker that has learnt how long its node takes.
class RtuWorkerPace : public ::testing::Test {
 protected:
  void learn() {
    bench_.start_and_open();
    for (int i = 0; i < ReplyPace::measured; ++i)
      ASSERT_EQ(bench_.run(read_).status, ExchangeStatus::replied);
  }
  void answer(const ScriptedNode& node, const Bytes& request) const {
    if (pause_ms_ < 0 || !node.pause(milliseconds(pause_ms_))) return;
    const auto refused = static_cast<std::uint8_t>(request[1] | 0x80U);
    node.say(refuses_ ? framed({request[0], refused, 0x05}) : proper_reply(request));
  }

  /// Far longer than a busy machine stalls.
  static constexpr auto long_pause = milliseconds(1500);

  std::atomic<int> pause_ms_ = 100;  ///< negative: no answer
  std::atomic<bool> refuses_ = false;
  ScriptedNode node_{[this](ScriptedNode& self, const Bytes& request) { answer(self, request); }};
  WorkerBench bench_{line_at(fast, node_.path())};
  Exchange read_ = read_of(0x0020, 4);
};

TEST_F(RtuWorkerPace, AReplyThatComesSoonerIsHeardAndTheNextOneInItsTime) {
  learn();
  pause_ms_ = 0;
  const auto sooner = bench_.run(read_);
  EXPECT_EQ(sooner.reply.registers, (std::vector<std::uint16_t>{0x20, 0x21, 0x22, 0x23}));
  const auto next = bench_.run(read_);
  EXPECT_EQ(next.status, ExchangeStatus::replied);
}

TEST_F(RtuWorkerPace, AReplyThatCameDuringTheSleepBeganBefore) {
  learn();
  pause_ms_ = 0;
  const auto result = bench_.run(read_);
  EXPECT_LE(result.reply_begin,
            result.reply_end - wire_time(line_at(fast).serial(), result.reply_frame.size()));
  EXPECT_GE(result.reply_begin, result.request_end);
}

TEST_F(RtuWorkerPace, AnExceptionIsHeard) {
  learn();
  refuses_ = true;
  EXPECT_EQ(bench_.run(read_).reply.exception_code, 5) << "shorter than what it would have answered";
  refuses_ = false;
  EXPECT_EQ(bench_.run(read_).reply.kind, ReplyKind::match);
}

TEST_F(RtuWorkerPace, ACutEndsTheSleepOverANodeThatFellSilent) {
  pause_ms_ = long_pause / milliseconds(1);
  learn();
  pause_ms_ = -1;
  auto exchange = read_of(0x0020, 4);
  exchange.turnaround_max = milliseconds(20);
  const auto before = node_.seen().size();
  bench_.worker->arm(exchange);
  ASSERT_TRUE(bench_.run_until([&] { return node_.seen().size() > before; }));
  bench_.worker->cut_wait();
  const auto result = bench_.next_result();
  EXPECT_EQ(result.status, ExchangeStatus::cut);
  EXPECT_LT(result.reply_end, result.request_end + long_pause);
}

TEST_F(RtuWorkerPace, ACutDuringTheSleepLosesNoReplyThatHasCome) {
  learn();
  pause_ms_ = 0;
  auto exchange = read_of(0x0020, 4);
  exchange.turnaround_max = milliseconds(50);  // the sleep would last twice as long
  const auto requests = node_.seen().size();
  const auto results = bench_.results.size();
  bench_.worker->arm(exchange);
  ASSERT_TRUE(bench_.run_until([&] { return node_.seen().size() > requests; }));
  bench_.worker->cut_wait();
  ASSERT_TRUE(bench_.run_until([&] { return bench_.results.size() > results; }));
  EXPECT_EQ(bench_.results.back().status, ExchangeStatus::replied);
}

TEST_F(RtuWorkerPace, TheTimeoutStillHolds) {
  pause_ms_ = long_pause / milliseconds(1);
  learn();
  pause_ms_ = -1;
  const auto result = bench_.run(read_of(0x0020, 4, milliseconds(30)));
  EXPECT_EQ(result.status, ExchangeStatus::timeout);
  EXPECT_LT(result.reply_end, result.request_end + long_pause);
}

TEST_F(RtuWorkerPace, WhatAWriteTakesSaysNothingOfReads) {
  pause_ms_ = long_pause / milliseconds(1);
  bench_.start_and_open();
  for (int i = 0; i < ReplyPace::measured; ++i)
    ASSERT_EQ(bench_.run(write_of(0x0020, 1)).status, ExchangeStatus::replied);
  pause_ms_ = 0;
  const auto result = bench_.run(read_);
  EXPECT_EQ(result.status, ExchangeStatus::replied);
  EXPECT_LT(result.reply_end, result.request_end + long_pause);
}

}  // namespace
}  // namespace axisd::modbus_rtu
