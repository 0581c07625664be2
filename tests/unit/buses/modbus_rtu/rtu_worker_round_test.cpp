// Rounds: exchanges that a worker carries out one after the other without the core, on a pty.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <random>

#include "worker_bench.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace test;

Frame reply_to(const Exchange& exchange) {
  const auto bytes = exchange.frame.bytes();
  return proper_reply({bytes.begin(), bytes.end()});
}

/// Three readings, each of one register, whose replies are known.
struct Round {
  std::array<Exchange, 3> exchanges;
  std::array<Frame, 3> known;

  explicit Round(std::uint16_t first = 0x0020, Duration reply_timeout = ample) { set(first, reply_timeout); }
  Round(const Round&) = delete;
  void set(std::uint16_t first, Duration reply_timeout = ample) {
    for (std::size_t i = 0; i < exchanges.size(); ++i) {
      exchanges.at(i) = read_of(static_cast<std::uint16_t>(first + i), 1, reply_timeout);
      known.at(i) = reply_to(exchanges.at(i));
      exchanges.at(i).known = &known.at(i);
      exchanges.at(i).round_longest = ample;
      if (i > 0) exchanges.at(i - 1).then = &exchanges.at(i);
    }
  }
  [[nodiscard]] std::string sent(std::size_t index) const { return hex(exchanges.at(index).frame); }
};

using Rounds = std::vector<std::size_t>;
using Sent = std::vector<std::string>;

/// Nothing of a round comes behind it any more.
void expect_sent_and_nothing_else(WorkerBench& bench, const ScriptedNode& node, Sent sent) {
  const auto results = bench.results.size();
  const auto last = read_of(0x0700, 1);
  EXPECT_EQ(bench.run(last).status, ExchangeStatus::replied);
  EXPECT_EQ(bench.results.size(), results + 1);
  sent.push_back(hex(last.frame));
  EXPECT_EQ(node.seen(), sent);
}

TEST(RtuWorkerRound, IsCarriedOutInOrderAndToldOnce) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const Round round;
  bench.worker->arm(round.exchanges.front());
  ASSERT_TRUE(bench.run_until([&] { return !bench.rounds.empty(); }));
  ASSERT_EQ(bench.rounds, Rounds{3});
  for (std::uint16_t i = 0; i < 3; ++i) {
    const auto& result = bench.results.at(i);
    EXPECT_EQ(result.status, ExchangeStatus::replied);
    EXPECT_EQ(result.registers(), (std::vector<std::uint16_t>{static_cast<std::uint16_t>(0x20 + i)}));
    if (i > 0) EXPECT_GE(result.request_begin - bench.results.at(i - 1).reply_end, silence(line_at(fast)));
  }
  expect_sent_and_nothing_else(bench, node, {round.sent(0), round.sent(1), round.sent(2)});
}

TEST(RtuWorkerRound, AChangedReplyIsToldWithThoseBeforeItAndTheRestIsNotSent) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  Round round;
  round.known.at(1) = framed({1, 3, 2, 0x12, 0x34});
  bench.worker->arm(round.exchanges.front());
  bench.next_result();
  EXPECT_EQ(bench.rounds, Rounds{2});
  EXPECT_EQ(bench.results.back().registers(), std::vector<std::uint16_t>{0x21});
  expect_sent_and_nothing_else(bench, node, {round.sent(0), round.sent(1)});
}

TEST(RtuWorkerRound, AReplyThatNobodyKnewEndsIt) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  Round round;
  round.exchanges.front().known = nullptr;
  bench.worker->arm(round.exchanges.front());
  bench.next_result();
  EXPECT_EQ(bench.rounds, Rounds{1});
  expect_sent_and_nothing_else(bench, node, {round.sent(0)});
}

TEST(RtuWorkerRound, AForeignFrameEndsItThoughTheReplyIsKnown) {
  const ScriptedNode node([](ScriptedNode& self, const Bytes& request) {
    self.say(framed({2, 3, 2, 0, 7}));
    self.say(proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const Round round;
  bench.worker->arm(round.exchanges.front());
  EXPECT_EQ(bench.next_result().foreign_frames, 1);
  EXPECT_EQ(bench.rounds, Rounds{1});
  EXPECT_EQ(node.seen(), Sent{round.sent(0)});
}

TEST(RtuWorkerRound, ARefusalEndsIt) {
  const ScriptedNode node([](ScriptedNode& self, const Bytes& request) {
    self.say(request[3] == 0x21 ? framed({request[0], 0x83, 0x02}) : proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const Round round;
  bench.worker->arm(round.exchanges.front());
  EXPECT_EQ(bench.next_result().reply.kind, ReplyKind::exception);
  EXPECT_EQ(bench.rounds, Rounds{2});
  expect_sent_and_nothing_else(bench, node, {round.sent(0), round.sent(1)});
}

TEST(RtuWorkerRound, ASilentNodeEndsIt) {
  const ScriptedNode node([](ScriptedNode& self, const Bytes& request) {
    if (request[3] != 0x21) self.say(proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  Round round;
  round.exchanges.at(1).reply_timeout = milliseconds(30);
  bench.worker->arm(round.exchanges.front());
  EXPECT_EQ(bench.next_result().status, ExchangeStatus::timeout);
  EXPECT_EQ(bench.rounds, Rounds{2});
  EXPECT_EQ(bench.results.front().status, ExchangeStatus::replied);
  expect_sent_and_nothing_else(bench, node, {round.sent(0), round.sent(1)});
}

TEST(RtuWorkerRound, WhatMayNotBeSentInTheMidstOfItEndsIt) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  Round round;
  const auto gate = std::make_shared<AxisGate>();
  round.exchanges.at(1).guard = {.gate = gate, .epoch = gate->epoch()};
  gate->raise();
  bench.worker->arm(round.exchanges.front());
  const auto result = bench.next_result();
  EXPECT_EQ(result.status, ExchangeStatus::not_sent);
  EXPECT_EQ(result.verdict, Verdict::superseded);
  EXPECT_EQ(bench.rounds, Rounds{2});
  expect_sent_and_nothing_else(bench, node, {round.sent(0)});
}

TEST(RtuWorkerRound, TakenBackBeforeItsFirstByteNothingIsSent) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(slow, node.path()));
  const Round round;
  const auto next = read_of(0x0100, 1);
  bench.on_open = [&] {
    bench.worker->arm(round.exchanges.front());
    const auto results = bench.worker->revoke();
    ASSERT_TRUE(results);
    EXPECT_TRUE(results->empty());
    bench.worker->arm(next);
  };
  bench.start();
  EXPECT_EQ(bench.next_result().status, ExchangeStatus::replied);
  EXPECT_EQ(bench.rounds, Rounds{1});
  EXPECT_EQ(node.seen(), Sent{hex(next.frame)});
}

/// Where the line is silent for long, the core finds the second one in the slot; how long the first takes to
/// be told off is the machine's.
TEST(RtuWorkerRound, TakenBackInTheSilenceGivesTheResultsSoFar) {
  const Round round;
  const auto request = wire_time(line_at(slow), round.exchanges.front().frame.size());
  const ScriptedNode node([&](ScriptedNode& self, const Bytes& asked) {
    if (self.pause(request))
      self.say(proper_reply(asked));  // not before the request can have left the adapter
  });
  WorkerBench bench(line_at(slow, node.path()));
  bench.start_and_open();
  Sent sent;
  bool in_silence = false;
  for (int attempt = 0; attempt < 5 && !in_silence; ++attempt) {
    const auto told = bench.results.size();
    const auto requests = node.seen().size();
    bench.worker->arm(round.exchanges.front());
    ASSERT_TRUE(bench.run_until([&] { return node.seen().size() > requests; }));
    const auto until = monotonic_now() + request + silence(line_at(slow)) / 4;
    ASSERT_TRUE(bench.run_until([&] { return monotonic_now() >= until; }));
    const auto results = bench.worker->revoke();
    in_silence = results && results->size() == 1;
    if (in_silence) {
      EXPECT_EQ(bench.results.size(), told) << "told by the one that took it back, alone";
      EXPECT_EQ(results->front().registers(), std::vector<std::uint16_t>{0x20});
    }
    if (!results) bench.next_result();
    sent = node.seen();
  }
  ASSERT_TRUE(in_silence);
  EXPECT_EQ(sent.back(), round.sent(0));
  expect_sent_and_nothing_else(bench, node, sent);
}

TEST(RtuWorkerRound, TakenBackWhileOneIsUnderWayItEndsWithThatOne) {
  for (const std::uint8_t under_way : {0, 1, 2}) {
    std::atomic<bool> released = false;
    const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
      while (request[3] == 0x20 + under_way && !released)
        if (!self.pause(milliseconds(1))) return;
      self.say(proper_reply(request));
    });
    WorkerBench bench(line_at(fast, node.path()));
    bench.start_and_open();
    const Round round;
    bench.worker->arm(round.exchanges.front());
    ASSERT_TRUE(bench.run_until([&] { return node.seen().size() == under_way + 1U; }));
    EXPECT_FALSE(bench.worker->revoke());
    EXPECT_TRUE(bench.results.empty());
    released = true;
    EXPECT_EQ(bench.next_result().registers(),
              std::vector<std::uint16_t>{static_cast<std::uint16_t>(0x20 + under_way)});
    EXPECT_EQ(bench.rounds, Rounds{under_way + 1U});
    Sent sent;
    for (std::size_t i = 0; i <= under_way; ++i) sent.push_back(round.sent(i));
    expect_sent_and_nothing_else(bench, node, sent);
  }
}

TEST(RtuWorkerRound, APortThatIsLostInTheMidstIsToldBeforeTheResults) {
  ScriptedNode node([](ScriptedNode& self, const Bytes& request) {
    if (request[3] != 0x21) self.say(proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const Round round;
  bench.worker->arm(round.exchanges.front());
  ASSERT_TRUE(bench.run_until([&] { return node.seen().size() == 2; }));
  EXPECT_TRUE(bench.results.empty());
  node.hang_up();
  ASSERT_TRUE(bench.run_until([&] { return !bench.results.empty() || !bench.ports.back().open; }));
  EXPECT_TRUE(bench.results.empty()) << "the core would arm the next one on a port that is lost";
  bench.next_result();
  EXPECT_EQ(bench.rounds, Rounds{2});
  EXPECT_EQ(bench.results.at(0).status, ExchangeStatus::replied);
  EXPECT_EQ(bench.results.at(1).status, ExchangeStatus::io_error);
}

/// What the core takes back at any moment: each exchange ends once, told or taken back, and what ended is
/// what went out.
class RtuWorkerRoundStress : public ::testing::Test {
 protected:
  void spin(Duration duration) const {
    for (const auto until = monotonic_now() + duration; monotonic_now() < until;)
      (void)bench_.worker->last_progress();
  }
  /// Close to where the worker goes from one to the next, or anywhere.
  void wait_for_a_moment() {
    if (dice_() % 2 == 0) return spin(std::chrono::microseconds(dice_() % 8000));
    const auto give_up = monotonic_now() + milliseconds(12);
    for (auto steps = 1 + dice_() % 16; steps > 0; --steps)
      for (const auto before = bench_.worker->last_progress(); bench_.worker->last_progress() == before;)
        if (monotonic_now() > give_up) return;
    spin(Duration(dice_() % 4000));
  }
  void note(std::span<const ExchangeResult> results, const Round& round) {
    ASSERT_LE(results.size(), 3U);
    for (std::size_t i = 0; i < results.size(); ++i) {
      ASSERT_EQ(results[i].status, ExchangeStatus::replied);
      ASSERT_EQ(hex(results[i].reply_frame), hex(round.known.at(i)));
      sent_.push_back(round.sent(i));
    }
  }

  std::mt19937 dice_{20261};
  const ScriptedNode node_{answering()};
  WorkerBench bench_{line_at(921600, node_.path())};
  Sent sent_;
};

TEST_F(RtuWorkerRoundStress, NothingIsLostOrTwice) {
  bench_.start_and_open();
  Round round;
  std::array<int, 2> ways{};
  const auto give_up = monotonic_now() + milliseconds(2500);
  int count = 0;
  for (; count < 2000 && monotonic_now() < give_up; ++count) {
    SCOPED_TRACE(count);
    round.set(static_cast<std::uint16_t>(3 * count));
    const auto told = bench_.results.size();
    const auto calls = bench_.rounds.size();
    bench_.worker->arm(round.exchanges.front());
    wait_for_a_moment();
    ASSERT_EQ(bench_.rounds.size(), calls);
    const auto taken = bench_.worker->revoke();
    const auto revoked_at = monotonic_now();
    ++ways.at(taken ? 1 : 0);
    if (taken) {
      ASSERT_NO_FATAL_FAILURE(note(*taken, round));
      ASSERT_LT(taken->size(), 3U);
      spin(Duration(dice_() % 4000));
      continue;  // the next one is armed at once, or nearly so
    }
    ASSERT_TRUE(bench_.run_until([&] { return bench_.rounds.size() > calls; }));
    ASSERT_GE(bench_.rounds.back(), 1U) << "nobody had taken it back";
    const auto results = std::span(bench_.results).subspan(told);
    ASSERT_NO_FATAL_FAILURE(note(results, round));
    // One may have been bound without a byte of it sent.
    ASSERT_LE(std::ranges::count_if(results, [&](const auto& one) { return one.request_begin > revoked_at; }),
              1);
  }
  EXPECT_EQ(node_.seen(), sent_);
  EXPECT_GT(ways[0], 0);
  EXPECT_GT(ways[1], 0);
}

}  // namespace
}  // namespace axisd::modbus_rtu
