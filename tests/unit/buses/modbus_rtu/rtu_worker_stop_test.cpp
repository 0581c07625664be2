// What a stop does to a worker that has something else to do, on a pty.
#include <gtest/gtest.h>

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
