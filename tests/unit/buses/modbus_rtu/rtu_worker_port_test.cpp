// Ports that are missing, in use, pulled out and plugged in again.
#include <gtest/gtest.h>

#include <filesystem>

#include "buses/modbus_rtu/serial_port.hpp"
#include "worker_bench.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace test;

/// A name for whatever port is there, as /dev/serial/by-id has them.
class PortLink {
 public:
  PortLink() : directory_(std::filesystem::temp_directory_path() / ("axisd-port-" + unique())) {
    std::filesystem::create_directories(directory_);
  }
  ~PortLink() { std::filesystem::remove_all(directory_); }
  PortLink(const PortLink&) = delete;
  [[nodiscard]] std::string path() const { return directory_ / "port"; }
  void plug_in(const std::string& port) const {
    std::filesystem::create_symlink(port, directory_ / "new");
    std::filesystem::rename(directory_ / "new", path());
  }

 private:
  static std::string unique() {
    return std::to_string(getpid()) + "-" + testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  std::filesystem::path directory_;
};

bool is_open(const WorkerBench& bench) { return !bench.ports.empty() && bench.ports.back().open; }
bool is_lost(const WorkerBench& bench) { return !bench.ports.empty() && !bench.ports.back().open; }

TEST(RtuWorkerPort, MissingAtStartIsReportedOnceAndOpenedWhenItComes) {
  const PortLink link;
  WorkerBench bench(line_at(115200, link.path()));
  bench.start();
  ASSERT_TRUE(bench.run_until([&] { return is_lost(bench); }));
  ASSERT_TRUE(bench.ports.back().error);
  EXPECT_EQ(bench.ports.back().error->reason, Reason::bus_down);
  EXPECT_NE(bench.ports.back().error->message.find(link.path()), std::string::npos);
  for (int attempt = 0; attempt < 3; ++attempt) bench.let_worker_notice();
  EXPECT_EQ(bench.ports.size(), 1U);
  const ScriptedNode node(answering());
  link.plug_in(node.path());
  ASSERT_TRUE(bench.run_until([&] { return is_open(bench); }));
  EXPECT_FALSE(bench.ports.back().error);
  EXPECT_EQ(bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
}

TEST(RtuWorkerPort, ADriverThatBlocksTheOpeningIsNoHang) {
  std::atomic<bool> asked = false;
  std::atomic<bool> answered = false;
  WorkerBench bench(line_at(115200, "unused"), [&]() -> Result<std::string> {
    asked = true;
    while (!answered) std::this_thread::yield();
    return fail(Error{.reason = Reason::bus_down, .message = "no port", .remedy = "plug it in"});
  });
  bench.start();
  ASSERT_TRUE(bench.run_until([&] { return asked.load(); }));
  EXPECT_GT(bench.worker->last_progress(), monotonic_now()) << "it is busy until then";
  answered = true;
  ASSERT_TRUE(bench.run_until([&] { return is_lost(bench); }));
  EXPECT_LE(bench.worker->last_progress(), monotonic_now()) << "from here on a hang is one";
}

TEST(RtuWorkerPort, HangUpInAWaitIsAnIoErrorAndThePortComesBackElsewhere) {
  const PortLink link;
  ScriptedNode first(silent());
  link.plug_in(first.path());
  WorkerBench bench(line_at(115200, link.path()));
  bench.start_and_open();
  const auto exchange = read_of(0x0020, 1);
  bench.worker->arm(exchange);
  ASSERT_TRUE(bench.run_until([&] { return first.seen().size() == 1; }));
  const ScriptedNode second(answering());  // before the hang-up, so that it gets another name
  first.hang_up();
  const auto result = bench.next_result();
  EXPECT_EQ(result.status, ExchangeStatus::io_error);
  EXPECT_EQ(result.native_error, EIO);
  EXPECT_TRUE(is_lost(bench));  // known before the result: nothing more is armed on the lost port
  link.plug_in(second.path());
  ASSERT_TRUE(bench.run_until([&] { return is_open(bench); }));
  EXPECT_EQ(bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
  EXPECT_EQ(bench.results.size(), 2U);
}

TEST(RtuWorkerPort, HangUpInsideAReplyIsAnIoError) {
  ScriptedNode node([](ScriptedNode& self, const Bytes&) { self.say(Bytes{1, 3, 2}); });
  WorkerBench bench(line_at(115200, node.path()));
  bench.start_and_open();
  const auto exchange = read_of(0x0020, 1);
  bench.worker->arm(exchange);
  ASSERT_TRUE(bench.run_until([&] { return node.seen().size() == 1; }));
  node.hang_up();
  EXPECT_EQ(bench.next_result().status, ExchangeStatus::io_error);
}

TEST(RtuWorkerPort, HangUpIsNoticedWhileIdle) {
  ScriptedNode node(silent());
  WorkerBench bench(line_at(115200, node.path()));
  bench.start_and_open();
  node.hang_up();
  ASSERT_TRUE(bench.run_until([&] { return is_lost(bench); }));
  EXPECT_NE(bench.ports.back().error->message.find(node.path()), std::string::npos);
}

TEST(RtuWorkerPort, ArmedExchangeOfALostPortEndsUnsentExactlyOnce) {
  ScriptedNode node(silent());
  WorkerBench bench(line_at(slow, node.path()));
  const auto exchange = write_of(0x0027, 1);
  bench.on_open = [&] {
    node.hang_up();  // the worker does not know it yet: the line must be silent first
    bench.worker->arm(exchange);
  };
  bench.start();
  const auto result = bench.next_result();
  EXPECT_EQ(result.status, ExchangeStatus::not_sent);
  EXPECT_EQ(result.verdict, Verdict::send);
  EXPECT_EQ(result.native_error, EIO);
  EXPECT_FALSE(bench.worker->revoke());
  // One that is armed in ignorance of the loss, too.
  EXPECT_EQ(bench.run(exchange).status, ExchangeStatus::not_sent);
  EXPECT_EQ(bench.results.size(), 2U);
  EXPECT_TRUE(node.seen().empty());
}

TEST(RtuWorkerPort, OneInUseIsReportedAndTakenWhenItIsFree) {
  const ScriptedNode node(answering());
  auto holder = SerialPort::open(line_at(115200), node.path());
  ASSERT_TRUE(holder);
  WorkerBench bench(line_at(115200, node.path()));
  bench.start();
  ASSERT_TRUE(bench.run_until([&] { return is_lost(bench); }));
  EXPECT_NE(bench.ports.back().error->message.find("in use"), std::string::npos);
  {
    const auto released = std::move(*holder);
  }
  ASSERT_TRUE(bench.run_until([&] { return is_open(bench); }));
  EXPECT_EQ(bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
}

TEST(RtuWorkerPort, PathIsAskedForAtEachOpening) {
  std::atomic<int> asked = 0;
  ScriptedNode first(answering());
  const ScriptedNode second(answering());
  auto settings = line_at(115200, "sim");
  WorkerBench bench(settings, [&]() -> Result<std::string> {
    switch (asked++) {
      case 0:
        return fail(Reason::bus_down, "the simulated line has not started");
      case 1:
        return first.path();
      default:
        return second.path();
    }
  });
  bench.start();
  ASSERT_TRUE(bench.run_until([&] { return is_lost(bench); }));
  EXPECT_EQ(bench.ports.back().error->message, "the simulated line has not started");
  ASSERT_TRUE(bench.run_until([&] { return is_open(bench); }));
  EXPECT_EQ(bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
  first.hang_up();
  ASSERT_TRUE(bench.run_until([&] { return is_lost(bench); }));
  ASSERT_TRUE(bench.run_until([&] { return is_open(bench); }));
  EXPECT_EQ(bench.run(read_of(0x0020, 1)).status, ExchangeStatus::replied);
  EXPECT_EQ(second.seen().size(), 1U);
}

}  // namespace
}  // namespace axisd::modbus_rtu
