#include "buses/modbus_rtu/rtu_worker.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "worker_bench.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace test;

TEST(RtuWorker, ReadsAndWrites) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto read = bench.run(read_of(0x0020, 4));
  EXPECT_EQ(read.status, ExchangeStatus::replied);
  EXPECT_EQ(read.registers(), (std::vector<std::uint16_t>{0x20, 0x21, 0x22, 0x23}));
  EXPECT_EQ(read.reply_frame, framed({1, 3, 8, 0, 0x20, 0, 0x21, 0, 0x22, 0, 0x23}));
  EXPECT_LT(read.request_begin, read.request_end);
  EXPECT_LE(read.reply_begin, read.reply_end);
  EXPECT_EQ(bench.run(write_of(0x0021, 500)).reply.kind, ReplyKind::match);
  const auto block = exchange_of({.node = 1,
                                  .function = Function::write_multiple_registers,
                                  .address = 0x20,
                                  .values = {10, 100, 100, 500, 0, 1000}});
  EXPECT_EQ(bench.run(block).reply.kind, ReplyKind::match);
  EXPECT_EQ(node.seen(), (std::vector<std::string>{"01 03 00 20 00 04 45 C3", "01 06 00 21 01 F4 D9 D7",
                                                   hex(block.frame)}));
}

TEST(RtuWorker, AssemblesRepliesFromAnyPieces) {
  std::atomic<std::size_t> piece = 1;
  const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
    const auto reply = proper_reply(request);
    for (auto rest = reply.bytes(); !rest.empty();) {
      const auto now = std::min<std::size_t>(piece, rest.size());
      self.say(rest.first(now));
      rest = rest.subspan(now);
      if (!rest.empty() && !self.pause(milliseconds(2))) return;
    }
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto exchange = read_of(0x0020, 6);
  for (piece = 1; piece <= 17; piece += 4) {
    const auto result = bench.run(exchange);
    EXPECT_EQ(result.status, ExchangeStatus::replied) << piece;
    EXPECT_EQ(result.registers().size(), 6U);
  }
}

TEST(RtuWorker, PassesOverForeignFrames) {
  const ScriptedNode node([](ScriptedNode& self, const Bytes& request) {
    self.say(framed({2, 3, 2, 0, 9}));  // another node: libmodbus filters it
    self.say(framed({1, 3, 2, 0, 9}));  // this node's answer to something else
    self.say(framed({1, 6, 0, 0x20, 0, 9}));
    self.say(proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto result = bench.run(read_of(0x0020, 2));
  EXPECT_EQ(result.status, ExchangeStatus::replied);
  EXPECT_EQ(result.registers(), (std::vector<std::uint16_t>{0x20, 0x21}));
  EXPECT_EQ(result.foreign_frames, 3);
}

TEST(RtuWorker, ForeignFramesAloneEndInTheTimeout) {
  const ScriptedNode node([](ScriptedNode& self, const Bytes&) { self.say(framed({2, 3, 2, 0, 9})); });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto result = bench.run(write_of(0x0027, 1, milliseconds(300)));
  EXPECT_EQ(result.status, ExchangeStatus::timeout);
  EXPECT_EQ(result.foreign_frames, 1);
  EXPECT_GE(result.reply_end, result.request_end + milliseconds(300));
}

TEST(RtuWorker, LateReplyDoesNotAnswerTheNextRequest) {
  std::atomic<int> requests = 0;
  const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
    if (++requests > 1) self.say(proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  EXPECT_EQ(bench.run(read_of(0x0020, 1, milliseconds(20))).status, ExchangeStatus::timeout);
  node.say(framed({1, 3, 2, 0xDE, 0xAD}));
  bench.let_worker_notice();
  const auto result = bench.run(read_of(0x0030, 1));
  EXPECT_EQ(result.status, ExchangeStatus::replied);
  EXPECT_EQ(result.registers(), std::vector<std::uint16_t>{0x30});
  EXPECT_EQ(result.foreign_frames, 1);
}

TEST(RtuWorker, AsksForAnEchoOncePerOpening) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  EXPECT_EQ(bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
  EXPECT_EQ(bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
  EXPECT_EQ(node.probes(), 1);
}

LineSettings with_witness(const ScriptedNode& node) {
  auto line = line_at(fast, node.path());
  line.echo_witness = 1;
  return line;
}

/// As `axisd --quiesce` opens a port: the wait for an echo would take 0.1 s before the first stop.
TEST(RtuWorker, AWitnessSavesTheWaitForAnEcho) {
  Duration least = ample;  // a busy computer may be late, but not each time
  for (int round = 0; round < 20 && least > milliseconds(50); ++round) {
    const ScriptedNode node(answering());
    WorkerBench bench(with_witness(node));
    const auto begun = monotonic_now();
    bench.start_and_open();
    least = std::min(least, monotonic_now() - begun);
    EXPECT_EQ(bench.run(write_of(0x0028, 0)).reply.kind, ReplyKind::match);
    EXPECT_EQ(node.seen(),
              (std::vector<std::string>{hex(read_of(0, 1).frame), hex(write_of(0x0028, 0).frame)}));
    EXPECT_EQ(node.probes(), 0);
  }
  EXPECT_LE(least, milliseconds(50));
}

TEST(RtuWorker, AWitnessThatRefusesTellsAsMuch) {
  const ScriptedNode node([](ScriptedNode& self, const Bytes& request) {
    self.say(request[1] == 3 ? framed({1, 0x83, 2}) : proper_reply(request));
  });
  WorkerBench bench(with_witness(node));
  bench.start_and_open();
  EXPECT_EQ(bench.run(write_of(0x0028, 0)).reply.kind, ReplyKind::match);
  EXPECT_EQ(node.seen().size(), 2U);
}

/// Neither is the echo taken for its answer, nor the answer for that of the next request.
TEST(RtuWorker, AWitnessAnswersBehindTheEcho) {
  const ScriptedNode node(
      [](ScriptedNode& self, const Bytes& request) {
        if (request[1] == 3 && !self.pause(milliseconds(10))) return;
        self.say(proper_reply(request));
      },
      /*echo=*/true);
  auto line = with_witness(node);
  line.turnaround_max = ample;
  WorkerBench bench(line);
  bench.start_and_open();
  EXPECT_EQ(bench.run(write_of(0x0028, 0)).reply.kind, ReplyKind::match);
  EXPECT_EQ(bench.run(read_of(0, 1)).reply.kind, ReplyKind::match);
  EXPECT_EQ(node.seen().size(), 3U) << "the witness was asked once";
}

TEST(RtuWorker, OfASilentWitnessTheEchoIsLearntAsWell) {
  for (const bool echo : {false, true}) {
    const ScriptedNode node(
        [](ScriptedNode& self, const Bytes& request) {
          if (request[0] != 1) self.say(proper_reply(request));
        },
        echo);
    WorkerBench bench(with_witness(node));
    bench.start_and_open();
    const auto stop = exchange_of(
        {.node = 2, .function = Function::write_single_register, .address = 0x0028, .values = {0}});
    EXPECT_EQ(bench.run(stop).reply.kind, ReplyKind::match) << echo;
    EXPECT_EQ(node.seen().size(), 2U) << echo;
  }
}

TEST(RtuWorker, EchoAloneIsNoReply) {
  const ScriptedNode node(silent(), /*echo=*/true);
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  EXPECT_EQ(bench.run(write_of(0x0027, 1, milliseconds(300))).status, ExchangeStatus::timeout);
  EXPECT_EQ(bench.run(read_of(0x0020, 1, milliseconds(300))).status, ExchangeStatus::timeout);
}

TEST(RtuWorker, EchoIsDiscardedBeforeTheReply) {
  const ScriptedNode node(answering(), /*echo=*/true);
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  for (int round = 0; round < 3; ++round) {
    EXPECT_EQ(bench.run(write_of(0x0027, 1)).reply.kind, ReplyKind::match);
    EXPECT_EQ(bench.run(read_of(0x0020, 2)).registers(), (std::vector<std::uint16_t>{0x20, 0x21}));
    EXPECT_EQ(bench
                  .run(exchange_of({.node = 1,
                                    .function = Function::write_multiple_registers,
                                    .address = 0x24,
                                    .values = {0, 5000}}))
                  .reply.kind,
              ReplyKind::match);
  }
}

TEST(RtuWorker, EchoThatTheProbeMissedIsLearntFromARead) {
  std::atomic<bool> echoing = true;
  const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
    if (echoing) self.say(request);
    self.say(proper_reply(request));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  for (int round = 0; round < 2; ++round)
    EXPECT_EQ(bench.run(read_of(0x0020, 2)).registers(), (std::vector<std::uint16_t>{0x20, 0x21}));
  EXPECT_EQ(bench.run(write_of(0x0027, 1)).reply.kind, ReplyKind::match);
  EXPECT_EQ(node.probes(), 1);
  // The adapter stops echoing: one exchange is lost, then a new probe has found out.
  echoing = false;
  EXPECT_EQ(bench.run(read_of(0x0020, 2, milliseconds(300))).status, ExchangeStatus::corrupt);
  EXPECT_EQ(bench.run(read_of(0x0020, 2)).status, ExchangeStatus::replied);
  EXPECT_EQ(node.probes(), 2);
}

TEST(RtuWorker, EchoThatTheProbeMissedIsLearntWhereARequestTakesLong) {
  const auto block = exchange_of({.node = 1,
                                  .function = Function::write_multiple_registers,
                                  .address = 0x20,
                                  .values = {10, 100, 100, 500, 0, 1000}});
  for (const auto& first : {read_of(0x0020, 2), block}) {
    const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
      self.say(request);
      self.say(proper_reply(request));
    });
    WorkerBench bench(line_at(9600, node.path()));
    bench.start_and_open();
    EXPECT_EQ(bench.run(first).reply.kind, ReplyKind::match) << hex(first.frame);
    EXPECT_EQ(bench.run(block).reply.kind, ReplyKind::match);
  }
}

TEST(RtuWorker, DamagedRepliesAreCorruptAndHarmNoLaterOne) {
  std::atomic<int> requests = 0;
  const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
    const auto reply = proper_reply(request);
    Bytes bytes(reply.bytes().begin(), reply.bytes().end());
    const int number = requests++;
    if (number == 0) bytes[4] ^= 0x10;                // wrong CRC
    if (number == 1) bytes[0] ^= 0x10;                // looks like another node's
    if (number == 2) bytes.resize(5);                 // the rest is lost
    if (number == 3) bytes.insert(bytes.begin(), 0);  // a spurious byte at the change of direction
    self.say(bytes);
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto first = bench.run(read_of(0x0020, 2));
  EXPECT_EQ(first.status, ExchangeStatus::corrupt);
  EXPECT_EQ(first.reply_frame.size(), 9U);  // kept for the trace
  EXPECT_EQ(first.reply_frame.bytes()[4], 0x30);
  for (int number = 1; number <= 3; ++number)
    EXPECT_EQ(bench.run(read_of(0x0020, 2, milliseconds(300))).status, ExchangeStatus::corrupt) << number;
  EXPECT_EQ(bench.run(read_of(0x0020, 2)).registers(), (std::vector<std::uint16_t>{0x20, 0x21}));
}

TEST(RtuWorker, ExceptionCodesComeThroughUnchanged) {
  std::atomic<std::uint8_t> code = 0;
  const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
    self.say(framed({1, static_cast<std::uint8_t>(request[1] | 0x80U), code}));
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  for (const unsigned each : {1U, 7U, 11U, 12U, 200U, 255U}) {
    code = static_cast<std::uint8_t>(each);
    const auto result = bench.run(write_of(0x0026, 8));
    EXPECT_EQ(result.status, ExchangeStatus::replied);
    EXPECT_EQ(result.reply.kind, ReplyKind::exception);
    EXPECT_EQ(result.reply.exception_code, each);
  }
}

TEST(RtuWorker, DrippingNodeDoesNotHoldTheLine) {
  std::atomic<int> dripped = 0;
  const ScriptedNode node([&](ScriptedNode& self, const Bytes& request) {
    const auto reply = proper_reply(request);
    for (const auto byte : reply.bytes()) {
      self.say(std::span(&byte, 1));
      ++dripped;
      if (!self.pause(milliseconds(100))) return;
    }
  });
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  EXPECT_EQ(bench.run(read_of(0x0020, 125, milliseconds(250))).status, ExchangeStatus::corrupt);
  EXPECT_LT(dripped, 250);  // of 255: with a timeout per byte all would have come first
}

TEST(RtuWorker, SupersededExpiredAndRevokedLeasesSendNothing) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const auto gate = std::make_shared<AxisGate>();
  gate->set_fencing_token(7);
  const auto now = monotonic_now();
  const auto guarded = [&](MotionGuard guard, TimePoint deadline = TimePoint::max()) {
    auto exchange = write_of(0x0027, 1);
    exchange.guard = std::move(guard);
    exchange.deadline = deadline;
    const auto result = bench.run(exchange);
    EXPECT_EQ(result.status == ExchangeStatus::replied, result.verdict == Verdict::send);
    return result.verdict;
  };
  const auto epoch = gate->epoch();
  EXPECT_EQ(guarded({.gate = gate, .epoch = epoch - 1, .fencing_token = 7}), Verdict::superseded);
  EXPECT_EQ(guarded({.gate = gate, .epoch = epoch, .fencing_token = 7, .not_after = now}), Verdict::expired);
  EXPECT_EQ(guarded({.gate = gate, .epoch = epoch, .fencing_token = 6}), Verdict::lease_lost);
  EXPECT_EQ(guarded({}, now), Verdict::expired);
  EXPECT_TRUE(node.seen().empty());
  EXPECT_EQ(guarded({.gate = gate, .epoch = epoch, .fencing_token = 7}), Verdict::send);
  EXPECT_EQ(node.seen().size(), 1U);
}

TEST(RtuWorker, ABabblingLineDoesNotKeepAStopFromBeingTried) {
  std::atomic<bool> stop_seen = false;
  const ScriptedNode node([&](ScriptedNode&, const Bytes&) { stop_seen = true; });
  WorkerBench bench(line_at(slow, node.path()));
  bench.start_and_open();
  std::thread babbler([&] {
    const std::uint8_t noise = 0x55;
    while (!stop_seen && node.pause(milliseconds(20))) node.say(std::span(&noise, 1));
  });
  const auto exchange = write_of(0x0028, 0, milliseconds(50));
  bench.worker->arm(exchange);
  EXPECT_TRUE(bench.run_until([&] { return stop_seen.load(); }));
  EXPECT_NE(bench.next_result().status, ExchangeStatus::replied);
  stop_seen = true;
  babbler.join();
}

TEST(RtuWorker, DestructionEndsAWaitButLetsTheRequestLeaveTheWire) {
  const ScriptedNode node(silent());
  const auto settings = line_at(slow, node.path());
  WorkerBench bench(settings);
  bench.start_and_open();
  const auto exchange = write_of(0x0028, 0, 100 * ample);
  const auto armed = monotonic_now();
  bench.worker->arm(exchange);
  // A pty delivers at once what would still be in the adapter for 0.7 s.
  ASSERT_TRUE(bench.run_until([&] { return node.seen() == std::vector{hex(exchange.frame)}; }));
  bench.worker.reset();
  const auto ended = monotonic_now();
  EXPECT_GE(ended, armed + wire_time(settings, exchange.frame.size()));
  EXPECT_LT(ended, armed + exchange.reply_timeout);
  EXPECT_TRUE(bench.results.empty());
}

TEST(RtuWorker, ProgressIsVisibleWhileIdle) {
  const ScriptedNode node(silent());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  bench.let_worker_notice();
}

TEST(RtuWorker, ThreadHasANameAndNoSignals) {
  const ScriptedNode node(silent());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  bool found = false;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::ifstream(task.path() / "comm") >> name;
    if (name != "rtu:line-a") continue;
    found = true;
    std::ifstream status(task.path() / "status");
    std::uint64_t blocked = 0;
    for (std::string key; status >> key;)
      if (key == "SigBlk:") status >> std::hex >> blocked;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGUSR1})
      EXPECT_NE(blocked & 1ULL << static_cast<unsigned>(signal - 1), 0U) << signal;
  }
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace axisd::modbus_rtu
