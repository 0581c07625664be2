// Replies of a node whose pace the worker knows: part of the wait for them is slept through.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "buses/modbus_rtu/reply_pace.hpp"
#include "buses/modbus_rtu/wake_latency.hpp"
#include "worker_bench.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace test;

/// A worker that has learnt how long its node takes.
class RtuWorkerPace : public ::testing::Test {
 protected:
  void learn() {
    bench_.start_and_open();
    learn_again();
  }
  /// Whatever came before, the next reading is slept before.
  void learn_again() {
    for (int i = 0; i < ReplyPace::measured; ++i) {
      const auto result = bench_.run(read_);
      ASSERT_EQ(result.status, ExchangeStatus::replied);
      ASSERT_EQ(result.registers(), registers_);
    }
  }
  /// To the next request.
  void answer_once(ScriptedNode::Script script) {
    const std::scoped_lock lock(mutex_);
    once_ = std::move(script);
  }
  void answer(ScriptedNode& node, const Bytes& request) {
    ScriptedNode::Script once;
    {
      const std::scoped_lock lock(mutex_);
      once.swap(once_);
    }
    if (once) return once(node, request);
    if (pause_ms_ < 0 || !node.pause(milliseconds(pause_ms_))) return;
    const auto refused = static_cast<std::uint8_t>(request[1] | 0x80U);
    node.say(refuses_ ? framed({request[0], refused, 0x05}) : proper_reply(request));
  }

  /// Far longer than a busy machine stalls.
  static constexpr auto long_pause = milliseconds(1500);

  std::atomic<int> pause_ms_ = 100;  ///< negative: no answer
  std::atomic<bool> refuses_ = false;
  std::mutex mutex_;
  ScriptedNode::Script once_;
  ScriptedNode node_{[this](ScriptedNode& self, const Bytes& request) { answer(self, request); }};
  WorkerBench bench_{line_at(fast, node_.path())};
  Exchange read_ = read_of(0x0020, 4);
  const std::vector<std::uint16_t> registers_{0x20, 0x21, 0x22, 0x23};
};

/// The first `count` bytes after `first`, the others `between` later.
ScriptedNode::Script in_pieces(const std::function<Frame(const Bytes&)>& reply, std::size_t count,
                               milliseconds first, milliseconds between) {
  return [=](ScriptedNode& node, const Bytes& request) {
    const auto frame = reply(request);
    if (!node.pause(first)) return;
    node.say(frame.bytes().first(count));
    if (node.pause(between)) node.say(frame.bytes().subspan(count));
  };
}
Frame refusal(const Bytes& request) {
  return framed({request[0], static_cast<std::uint8_t>(request[1] | 0x80U), 0x05});
}
/// To somebody else's reading of so many registers, none of which this node has.
Frame foreign(std::uint8_t registers) {
  Bytes bytes{2, 3, static_cast<std::uint8_t>(2 * registers)};
  bytes.resize(bytes.size() + std::size_t{2} * registers, 0x77);
  return framed(bytes);
}

TEST_F(RtuWorkerPace, AReplyThatComesSoonerIsHeardAndTheNextOneInItsTime) {
  learn();
  pause_ms_ = 0;
  const auto sooner = bench_.run(read_);
  EXPECT_EQ(sooner.registers(), (std::vector<std::uint16_t>{0x20, 0x21, 0x22, 0x23}));
  const auto next = bench_.run(read_);
  EXPECT_EQ(next.status, ExchangeStatus::replied);
}

TEST_F(RtuWorkerPace, ANodeThatBecameFasterIsNoticed) {
  constexpr auto before = milliseconds(400);
  pause_ms_ = before / milliseconds(1);
  learn();
  pause_ms_ = 0;
  const auto took = [&] {
    const auto result = bench_.run(read_);
    EXPECT_EQ(result.status, ExchangeStatus::replied);
    return result.reply_end - result.request_end;
  };
  EXPECT_GT(took(), before / 2) << "nobody knows yet";
  for (int i = 1; i < ReplyPace::suspicious; ++i) took();
  // A busy machine stalls, but not each time.
  EXPECT_LT(std::min({took(), took(), took(), took(), took()}), before / 2);
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

TEST_F(RtuWorkerPace, TheSilenceIsKeptFromWhenTheNodeFellSilent) {
  pause_ms_ = 3;
  learn();
  std::atomic<TimePoint> said{};
  for (int i = 0; i < LeastLatency::remembered + 20; ++i) {
    const auto before = said.load();
    answer_once([&](ScriptedNode& node, const Bytes& request) {
      if (!node.pause(milliseconds(3))) return;
      said = monotonic_now();
      node.say(proper_reply(request));
    });
    const auto result = bench_.run(read_);
    ASSERT_EQ(result.status, ExchangeStatus::replied);
    if (i > 0) EXPECT_GE(result.request_begin - before, silence(line_at(fast)) - LeastLatency::surely);
  }
}

TEST_F(RtuWorkerPace, TheTimeoutStillHolds) {
  pause_ms_ = long_pause / milliseconds(1);
  learn();
  pause_ms_ = -1;
  const auto result = bench_.run(read_of(0x0020, 4, milliseconds(30)));
  EXPECT_EQ(result.status, ExchangeStatus::timeout);
  EXPECT_LT(result.reply_end, result.request_end + long_pause);
}

/// During the sleep, which lasts nearly 100 ms, across its end, and after it.
TEST_F(RtuWorkerPace, AReplyInTwoPiecesIsHeardToItsEnd) {
  struct Times {
    int first_ms, between_ms;
  };
  learn();
  for (const auto& times : {Times{0, 20}, Times{0, 200}, Times{150, 50}})
    for (const std::size_t count : {1, 2, 3, 12}) {
      SCOPED_TRACE(testing::Message() << count << " bytes after " << times.first_ms << " ms");
      answer_once(
          in_pieces(proper_reply, count, milliseconds(times.first_ms), milliseconds(times.between_ms)));
      const auto result = bench_.run(read_);
      EXPECT_EQ(result.status, ExchangeStatus::replied);
      EXPECT_EQ(result.registers(), registers_);
      EXPECT_EQ(result.foreign_frames, 0);
      learn_again();
    }
}

TEST_F(RtuWorkerPace, AnExceptionInTwoPiecesIsHeardToItsEnd) {
  learn();
  for (const int between_ms : {20, 200})
    for (const std::size_t count : {1, 2, 3, 4, 5}) {
      SCOPED_TRACE(testing::Message() << count << " bytes, " << between_ms << " ms before the others");
      answer_once(in_pieces(refusal, count, {}, milliseconds(between_ms)));
      const auto result = bench_.run(read_);
      EXPECT_EQ(result.status, ExchangeStatus::replied);
      EXPECT_EQ(result.reply.kind, ReplyKind::exception);
      EXPECT_EQ(result.reply.exception_code, 5);
      EXPECT_EQ(result.reply_frame.size(), 5U);
      learn_again();
    }
}

TEST_F(RtuWorkerPace, ADamagedReplyIsNoReplyAndTheNextOnesAreHeard) {
  learn();
  for (const std::size_t damaged : {0, 1, 2, 5, 12}) {
    SCOPED_TRACE(damaged);
    answer_once([damaged](const ScriptedNode& node, const Bytes& request) {
      const auto reply = proper_reply(request);
      Bytes bytes(reply.bytes().begin(), reply.bytes().end());
      bytes.at(damaged) ^= 0x80U;
      node.say(bytes);
    });
    const auto result = bench_.run(read_);
    EXPECT_EQ(result.status, ExchangeStatus::corrupt);
    EXPECT_EQ(result.reply_frame.size(), 13U) << "for whoever looks for the cause";
    learn_again();
  }
}

TEST_F(RtuWorkerPace, AnothersReplyOfTheSameSizeIsCountedAndItsOwnTaken) {
  learn();
  for (const int pause_ms : {0, 20, 200}) {
    SCOPED_TRACE(pause_ms);
    answer_once([pause_ms](const ScriptedNode& node, const Bytes& request) {
      node.say(foreign(4));
      if (node.pause(milliseconds(pause_ms))) node.say(proper_reply(request));
    });
    const auto result = bench_.run(read_);
    EXPECT_EQ(result.status, ExchangeStatus::replied);
    EXPECT_EQ(result.registers(), registers_);
    EXPECT_EQ(result.foreign_frames, 1);
    learn_again();
  }
}

/// A late reply is told from the next one's by its length alone, as RtuBus sees to.
TEST_F(RtuWorkerPace, AnothersReplyOfAnotherSizeIsTakenForNoReplyOfItsOwn) {
  learn();
  for (const std::uint8_t registers : {1, 3, 5, 10})
    for (const int pause_ms : {0, 20, 200}) {
      SCOPED_TRACE(testing::Message() << int{registers} << " registers, " << pause_ms << " ms");
      answer_once([=](const ScriptedNode& node, const Bytes& request) {
        node.say(foreign(registers));
        if (node.pause(milliseconds(pause_ms))) node.say(proper_reply(request));
      });
      const auto result = bench_.run(read_);
      if (result.status == ExchangeStatus::replied)
        EXPECT_EQ(result.registers(), registers_);
      else
        EXPECT_EQ(result.status, ExchangeStatus::corrupt);
      const auto next = bench_.run(read_of(0x0040, 2));
      EXPECT_EQ(next.status, ExchangeStatus::replied);
      EXPECT_EQ(next.registers(), (std::vector<std::uint16_t>{0x40, 0x41}));
      learn_again();
    }
}

TEST_F(RtuWorkerPace, AReplyThatStaysIncompleteIsNone) {
  learn();
  for (const std::size_t count : {1, 2, 5, 12}) {
    SCOPED_TRACE(count);
    answer_once([count](const ScriptedNode& node, const Bytes& request) {
      node.say(proper_reply(request).bytes().first(count));
    });
    const auto result = bench_.run(read_of(0x0020, 4, milliseconds(300)));
    EXPECT_TRUE(result.status == ExchangeStatus::corrupt || result.status == ExchangeStatus::timeout);
    EXPECT_GE(result.reply_end, result.request_end + milliseconds(300));
    learn_again();
  }
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
