// What a stop does to a worker that has something else to do, on a pty.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "worker_bench.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace test;

TEST(RtuWorkerStop, StopDuringTheSilenceStillSupersedes) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(slow, node.path()));
  const auto gate = std::make_shared<AxisGate>();
  auto exchange = write_of(0x0027, 1);
  exchange.guard = {.gate = gate, .epoch = gate->epoch()};
  bench.on_open = [&] {
    bench.worker->arm(exchange);
    gate->request_stop();
  };
  bench.start();
  const auto result = bench.next_result();
  EXPECT_EQ(result.status, ExchangeStatus::not_sent);
  EXPECT_EQ(result.verdict, Verdict::superseded);
  EXPECT_TRUE(node.seen().empty());
}

TEST(RtuWorkerStop, RevokedExchangeIsNeverSentAndItsSuccessorIs) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(slow, node.path()));
  const auto motion = write_of(0x0027, 1);
  const auto stop = write_of(0x0028, 0);
  bench.on_open = [&] {
    bench.worker->arm(motion);
    EXPECT_TRUE(bench.worker->revoke());
    EXPECT_FALSE(bench.worker->revoke());
    bench.worker->arm(stop);
  };
  bench.start();
  EXPECT_EQ(bench.next_result().status, ExchangeStatus::replied);
  EXPECT_FALSE(bench.worker->revoke());
  EXPECT_EQ(node.seen(), std::vector<std::string>{hex(stop.frame)});
  EXPECT_EQ(bench.results.size(), 1U);
}

TEST(RtuWorkerStop, WhatIsArmedWaitsForAnAnnouncedStopButNotForLong) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto notice = bench.worker->stop_notice();
  const auto read = read_of(0x0020, 1);
  auto stop = write_of(0x0028, 0);
  stop.stop = true;
  const auto far = monotonic_now() + ample;
  notice->give(far);
  bench.worker->arm(read);
  bench.let_worker_notice();
  EXPECT_TRUE(bench.worker->revoke()) << "the stop is on its way";
  bench.worker->arm(stop);
  EXPECT_LT(bench.next_result().request_begin, far);
  EXPECT_EQ(node.seen(), std::vector<std::string>{hex(stop.frame)});
  notice->take();
  const auto given = monotonic_now();
  notice->give(given);
  EXPECT_GE(bench.run(read).request_begin, given + milliseconds(5)) << "it did not come";
}

TEST(RtuWorkerStop, WhatIsArmedGoesOnceTheAnnouncedStopAskedNothingOfTheLine) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto notice = bench.worker->stop_notice();
  const auto read = read_of(0x0020, 1);
  const auto far = monotonic_now() + ample;
  notice->give(far);
  bench.worker->arm(read);
  bench.let_worker_notice();
  EXPECT_TRUE(bench.results.empty());
  notice->take();
  EXPECT_LT(bench.next_result().request_begin, far);
}

TEST(RtuWorkerStop, AnAnnouncedStopShortensNoSilence) {
  constexpr int baud = 1200;
  const ScriptedNode node(answering());
  const auto line = line_at(baud, node.path());
  WorkerBench bench(line);
  bench.start_and_open();
  const auto notice = bench.worker->stop_notice();
  const auto read = read_of(0x0020, 1);
  for (int i = 0; i < 3; ++i) {
    const auto before = bench.run(read).reply_end;
    notice->give();
    bench.worker->arm(read);
    notice->take();
    EXPECT_GE(bench.next_result().request_begin, before + silence(line));
  }
}

TEST(RtuWorkerStop, AFloodOfAnnouncedStopsLetsEveryExchangeThrough) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  std::atomic<bool> over{false};
  std::thread flood([&, notice = bench.worker->stop_notice()] {
    while (!over) notice->give();
  });
  for (int i = 0; i < 5; ++i) EXPECT_EQ(bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
  over = true;
  flood.join();
}

/// A worker whose port was opened while a stop was announced: nobody has looked for an echo.
class StopBeforeTheEchoIsKnown {
 public:
  StopBeforeTheEchoIsKnown(ScriptedNode::Script script, bool echo)
      : node(
            [this, answer = std::move(script)](ScriptedNode& self, const Bytes& request) {
              if (seen_++ == 0) probes_before_it = self.probes();
              answer(self, request);
            },
            echo),
        bench(line_at(fast, node.path())) {
    stop.stop = true;
    bench.worker->stop_notice()->give(monotonic_now() + ample);
    bench.on_open = [this] { bench.worker->arm(stop); };
    bench.start();
    result = bench.next_result();
    bench.worker->stop_notice()->take();
  }

 private:
  int seen_ = 0;  ///< thread: the node's

 public:
  /// How often the adapter had been asked for its echo when the stop came: right behind the stop it is asked.
  std::atomic<int> probes_before_it = -1;
  ScriptedNode node;
  WorkerBench bench;
  Exchange stop = write_of(0x0028, 0, milliseconds(300));
  ExchangeResult result;
};

TEST(RtuWorkerStop, TheEchoProbeLetsAStopGoFirst) {
  StopBeforeTheEchoIsKnown line(answering(), /*echo=*/false);
  EXPECT_EQ(line.node.seen(), std::vector<std::string>{hex(line.stop.frame)});
  EXPECT_EQ(line.probes_before_it, 0);
  EXPECT_EQ(line.result.status, ExchangeStatus::timeout) << "it might have been an echo";
  EXPECT_EQ(line.bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
  EXPECT_EQ(line.node.probes(), 1);
  EXPECT_EQ(line.bench.run(line.stop).status, ExchangeStatus::replied);
}

TEST(RtuWorkerStop, AStopThatGoesFirstIsAnsweredBehindItsEcho) {
  StopBeforeTheEchoIsKnown line(answering(), /*echo=*/true);
  EXPECT_EQ(line.result.status, ExchangeStatus::replied);
  EXPECT_EQ(line.bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
  EXPECT_EQ(line.node.probes(), 0) << "there is nothing left to find out";
}

TEST(RtuWorkerStop, TheEchoOfAStopThatGoesFirstIsNoReply) {
  StopBeforeTheEchoIsKnown line(silent(), /*echo=*/true);
  EXPECT_EQ(line.result.status, ExchangeStatus::timeout);
}

/// An adapter that echoes no more is asked again, and that takes 0.1 s without an answer (M33).
TEST(RtuWorkerStop, AStopEndsTheWaitForAnEcho) {
  std::atomic<bool> echoing = false;
  const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
    if (echoing) self.say(request);
    self.say(proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  auto stop = write_of(0x0028, 0, milliseconds(300));
  stop.stop = true;
  const auto is_in_time = [&] {
    echoing = true;
    EXPECT_TRUE(bench.run_until([&] {
      return bench.run(read_of(0x0020, 2, milliseconds(300))).status == ExchangeStatus::replied;
    })) << "an echo is known";
    echoing = false;
    const auto before = node.probes();
    EXPECT_EQ(bench.run(read_of(0x0020, 2, milliseconds(300))).status, ExchangeStatus::corrupt);
    EXPECT_TRUE(bench.run_until([&] { return node.probes() > before; }));
    const auto asked = monotonic_now();
    return bench.run(stop).request_begin - asked < milliseconds(50);
  };
  bool in_time = false;  // a busy computer may be late, but not each time
  for (int round = 0; round < 20 && !in_time; ++round) in_time = is_in_time();
  EXPECT_TRUE(in_time);
}

/// A known echo does not come where the adapter has lost its driver: the next stop does not wait longer.
TEST(RtuWorkerStop, CutEndsTheWaitForAnEchoToo) {
  std::atomic<bool> echoing = true;
  const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
    if (!echoing) return;
    self.say(request);
    self.say(proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto waits = [&] {
    echoing = true;
    EXPECT_EQ(bench.run(read_of(0x0020, 2)).status, ExchangeStatus::replied) << "an echo is known";
    echoing = false;
    const auto before = node.seen().size();
    const auto read = read_of(0x0020, 2);
    bench.worker->arm(read);
    EXPECT_TRUE(bench.run_until([&] { return node.seen().size() > before; }));
    bench.worker->cut_wait();
    const auto result = bench.next_result();
    EXPECT_GE(result.reply_end, result.request_end + read.turnaround_max);
    return result.reply_end - result.request_end;
  };
  Duration least = ample;  // a busy computer may be late, but not each time
  for (int round = 0; round < 20 && least > milliseconds(80); ++round) least = std::min(least, waits());
  EXPECT_LE(least, milliseconds(80)) << "an echo may take longer";
}

TEST(RtuWorkerStop, CutEndsTheWaitForASilentNode) {
  const ScriptedNode node(silent());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto exchange = read_of(0x0020, 1, 10 * ample);
  bench.worker->arm(exchange);
  ASSERT_TRUE(bench.run_until([&] { return node.seen().size() == 1; }));
  bench.worker->cut_wait();
  const auto result = bench.next_result();
  EXPECT_EQ(result.status, ExchangeStatus::cut);
  EXPECT_GE(result.reply_end, result.request_end + exchange.turnaround_max);
}

TEST(RtuWorkerStop, CutNeverFallsIntoAReply) {
  const ScriptedNode node([](ScriptedNode& self, const Bytes& request) {
    const auto reply = proper_reply(request);
    self.say(reply.bytes().first(3));
    if (self.pause(seconds(1))) self.say(reply.bytes().subspan(3));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  auto exchange = read_of(0x0020, 2);
  exchange.turnaround_max = milliseconds(700);  // the first bytes are there by then, the others are not
  bench.worker->arm(exchange);
  ASSERT_TRUE(bench.run_until([&] { return node.seen().size() == 1; }));
  bench.worker->cut_wait();
  EXPECT_EQ(bench.next_result().status, ExchangeStatus::replied);
}

TEST(RtuWorkerStop, CutThatComesTooLateDoesNotTouchTheNextExchange) {
  const ScriptedNode node([](ScriptedNode& self, const Bytes& request) {
    if (self.pause(milliseconds(200))) self.say(proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  auto exchange = read_of(0x0020, 1);
  exchange.turnaround_max = Duration::zero();
  for (int round = 0; round < 2; ++round) {
    bench.worker->cut_wait();
    bench.let_worker_notice();
    EXPECT_EQ(bench.run(exchange).status, ExchangeStatus::replied);
    bench.worker->cut_wait();
  }
}

}  // namespace
}  // namespace axisd::modbus_rtu
