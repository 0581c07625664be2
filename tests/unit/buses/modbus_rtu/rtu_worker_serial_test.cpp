// A worker whose exchanges have serial settings of their own, on a pty.
#include <gtest/gtest.h>

#include <map>

#include "worker_bench.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace test;

constexpr SerialSettings other{.baud = 9600, .format = {.stop_bits = 2}};

Exchange with(Exchange exchange, std::optional<SerialSettings> serial) {
  exchange.serial = serial;
  return exchange;
}

/// Answers with the address of each register, and notes by it how the terminal was set when it was asked.
class SettingsSeen {
 public:
  struct Seen {
    int baud;
    bool two_stop_bits;
  };
  ScriptedNode::Script script() {
    return [this](ScriptedNode& self, const Bytes& request) {
      const Seen now{.baud = self.terminal_speed(), .two_stop_bits = (self.terminal().c_cflag & CSTOPB) != 0};
      {
        const std::scoped_lock lock(mutex_);
        seen_[request[3]] = now;
      }
      self.say(proper_reply(request));
    };
  }
  Seen at(std::uint8_t address) {
    const std::scoped_lock lock(mutex_);
    return seen_.at(address);
  }

 private:
  std::mutex mutex_;
  std::map<std::uint8_t, Seen> seen_;
};

TEST(RtuWorkerSerial, ThePortHasTheSettingsOfEachExchange) {
  SettingsSeen seen;
  const ScriptedNode node(seen.script());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  const std::optional<SerialSettings> order[] = {std::nullopt, other, other,
                                                 std::nullopt, other, std::nullopt};
  std::uint8_t address = 0;
  for (const auto& serial : order) {
    const auto result = bench.run(with(read_of(address, 1), serial));
    ASSERT_EQ(result.status, ExchangeStatus::replied);
    const auto used = serial.value_or(line_at(fast).serial());
    const auto settings = seen.at(address++);
    EXPECT_EQ(settings.baud, used.baud);
    EXPECT_EQ(settings.two_stop_bits, used.format.stop_bits == 2);
    EXPECT_GE(result.request_end - result.request_begin, wire_time(used, 8));
  }
  EXPECT_EQ(node.probes(), 1) << "the echo is the adapter's, not the rate's";
}

TEST(RtuWorkerSerial, TheSilenceAndTheTimesAreThoseOfTheNewRate) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  constexpr SerialSettings slowest{.baud = 1200};
  const auto before = bench.run(read_of(0x0020, 1));
  const auto slow = bench.run(with(read_of(0x0020, 1), slowest));
  const auto after = bench.run(read_of(0x0020, 1));
  EXPECT_GE(slow.request_begin - before.reply_end, silence(slowest));
  EXPECT_GE(slow.request_end - slow.request_begin, wire_time(slowest, 8));
  EXPECT_GE(after.request_begin - slow.reply_end, silence(line_at(fast)));
}

TEST(RtuWorkerSerial, AGateThatIsRaisedDuringTheSwitchStillSupersedes) {
  const ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  constexpr SerialSettings slowest{.baud = 50};  // 3.5 characters take 700 ms
  const auto gate = std::make_shared<AxisGate>();
  auto exchange = with(read_of(0x0020, 1), slowest);
  exchange.guard = {.gate = gate, .epoch = gate->epoch()};
  bench.worker->arm(exchange);
  // Once it cannot be taken back any more, the worker is switching.
  ASSERT_TRUE(bench.run_until([&] { return node.terminal_speed() == slowest.baud; }));
  gate->request_stop();
  const auto result = bench.next_result();
  EXPECT_EQ(result.status, ExchangeStatus::not_sent);
  EXPECT_EQ(result.verdict, Verdict::superseded);
  EXPECT_TRUE(node.seen().empty());
}

TEST(RtuWorkerSerial, AHangUpAtTheSwitchIsALostPort) {
  ScriptedNode node(answering());
  WorkerBench bench(line_at(fast, node.path()));
  bench.start_and_open();
  EXPECT_EQ(bench.run(with(read_of(0x0020, 1), other)).status, ExchangeStatus::replied);
  node.hang_up();
  const auto result = bench.run(read_of(0x0021, 1));
  EXPECT_TRUE(result.status == ExchangeStatus::not_sent || result.status == ExchangeStatus::io_error);
  EXPECT_TRUE(bench.run_until([&] { return !bench.ports.back().open; }));
}

}  // namespace
}  // namespace axisd::modbus_rtu
