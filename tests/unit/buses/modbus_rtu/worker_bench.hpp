// A worker on one end of a pty, a scripted node on the other, and the test as the core thread between them.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "buses/modbus_rtu/rtu_worker.hpp"
#include "terminal.hpp"

namespace axisd::modbus_rtu::test {

using Bytes = std::vector<std::uint8_t>;
using std::chrono::milliseconds;
using std::chrono::seconds;

inline constexpr Duration ample = seconds(30);  ///< "does not happen": far longer than a busy machine stalls
inline constexpr int fast = 115200;
/// 3.5 characters take 318 ms: time enough for the core to act in the silence, however busy the machine.
inline constexpr int slow = 110;
inline constexpr std::uint8_t nobody = 248;  ///< address of the worker's echo probe

inline std::string hex(const Frame& frame) { return to_hex(frame.bytes()); }
inline Frame framed(Bytes bytes) {
  Frame frame(bytes);
  frame.append_crc();
  return frame;
}

/// The other end of the line. `script` runs on the node's thread for each request that is not the echo probe.
class ScriptedNode {
 public:
  using Script = std::function<void(ScriptedNode&, const Bytes&)>;

  explicit ScriptedNode(Script script, bool echo = false) : script_(std::move(script)), echo_(echo) {
    std::array<char, 64> name{};
    if (openpty(&master_, &slave_, name.data(), nullptr, nullptr) != 0) throw std::runtime_error("openpty");
    path_ = name.data();
    termios raw{};
    tcgetattr(slave_, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave_, TCSANOW, &raw);
    end_ = eventfd(0, EFD_CLOEXEC);
    thread_ = std::thread([this] { run(); });
  }
  ~ScriptedNode() {
    hang_up();
    close(end_);
  }
  ScriptedNode(const ScriptedNode&) = delete;

  /// Thread: the test's. Ends the node; the worker sees a hang-up.
  void hang_up() {
    if (!thread_.joinable()) return;
    eventfd_write(end_, 1);
    thread_.join();
    close(master_);
    close(slave_);
  }
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Thread: any. Puts bytes on the wire.
  void say(std::span<const std::uint8_t> bytes) const {
    if (::write(master_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
      throw std::runtime_error("short write to the pty");
  }
  void say(const Frame& frame) const { say(frame.bytes()); }
  /// Thread: the node's. False once the node is to end.
  [[nodiscard]] bool pause(Duration duration) const {
    pollfd end{.fd = end_, .events = POLLIN, .revents = 0};
    return poll(&end, 1, static_cast<int>(duration / milliseconds(1))) == 0;
  }
  /// Thread: any. The requests seen so far, without echo probes, in hex.
  [[nodiscard]] std::vector<std::string> seen() const {
    const std::scoped_lock lock(mutex_);
    return seen_;
  }
  /// Thread: any. How the terminal is set now: a pty keeps speed and stop bits.
  [[nodiscard]] termios terminal() const {
    termios settings{};
    if (tcgetattr(slave_, &settings) != 0) throw std::runtime_error("tcgetattr");
    return settings;
  }
  [[nodiscard]] int terminal_speed() const { return speed_of(slave_); }
  /// Thread: any. How many echo probes came.
  [[nodiscard]] int probes() const { return probes_; }

 private:
  void run() {
    Bytes pending;
    for (;;) {
      std::array<pollfd, 2> watched{
          {{.fd = master_, .events = POLLIN, .revents = 0}, {.fd = end_, .events = POLLIN, .revents = 0}}};
      poll(watched.data(), watched.size(), -1);
      if (watched[1].revents != 0) return;
      std::array<std::uint8_t, 256> buffer{};
      const auto got = ::read(master_, buffer.data(), buffer.size());
      if (got <= 0) return;
      pending.insert(pending.end(), buffer.begin(), buffer.begin() + got);
      while (pending.size() >= 8 && pending.size() >= request_size(pending)) {
        const auto size = static_cast<std::ptrdiff_t>(request_size(pending));
        const Bytes request(pending.begin(), pending.begin() + size);
        pending.erase(pending.begin(), pending.begin() + size);
        on_request(request);
      }
    }
  }
  static std::size_t request_size(const Bytes& start) { return start[1] == 0x10 ? 9U + start[6] : 8U; }
  void on_request(const Bytes& request) {
    if (echo_) say(request);
    if (request[0] == nobody) {
      ++probes_;
      return;
    }
    {
      const std::scoped_lock lock(mutex_);
      seen_.push_back(to_hex(request));
    }
    script_(*this, request);
  }

  Script script_;
  bool echo_;
  int master_ = -1, slave_ = -1, end_ = -1;
  std::string path_;
  mutable std::mutex mutex_;
  std::vector<std::string> seen_;
  std::atomic<int> probes_ = 0;
  std::thread thread_;
};

inline ScriptedNode::Script silent() {
  return [](ScriptedNode&, const Bytes&) {};
}
/// Answers as a drive does: reads with the address of each register, writes with their echo.
inline Frame proper_reply(const Bytes& request) {
  Frame reply;
  if (request[1] == 0x03) {
    reply.append(request[0]);
    reply.append(request[1]);
    reply.append(static_cast<std::uint8_t>(2 * request[5]));
    for (int index = 0; index < request[5]; ++index)
      reply.append_word(static_cast<std::uint16_t>(request[2] << 8U | (request[3] + index)));
  } else {
    reply = Frame(std::span(request).first(6));
  }
  reply.append_crc();
  return reply;
}
inline ScriptedNode::Script answering() {
  return [](ScriptedNode& node, const Bytes& request) { node.say(proper_reply(request)); };
}

inline LineSettings line_at(int baud, std::string port = "") {
  return {.name = "line-a", .port = std::move(port), .baud = baud};
}

inline Exchange exchange_of(Request request, Duration reply_timeout = ample) {
  Exchange exchange;
  exchange.frame = *encode(request);
  exchange.request = std::move(request);
  exchange.reply_timeout = reply_timeout;
  exchange.turnaround_max = milliseconds(20);
  return exchange;
}
inline Exchange read_of(std::uint16_t address, std::uint16_t count, Duration reply_timeout = ample) {
  return exchange_of({.node = 1, .address = address, .count = count}, reply_timeout);
}
inline Exchange write_of(std::uint16_t address, std::uint16_t value, Duration reply_timeout = ample) {
  return exchange_of(
      {.node = 1, .function = Function::write_single_register, .address = address, .values = {value}},
      reply_timeout);
}

/// The core: runs what the worker posts, on the test's thread.
class WorkerBench {
 public:
  explicit WorkerBench(LineSettings settings, RtuWorker::PortPath path = {})
      : worker(std::make_unique<RtuWorker>(io_.get_executor(), std::move(settings), std::move(path))) {}

  void start() {
    worker->start(
        [this](std::span<const ExchangeResult> told) {
          results.insert(results.end(), told.begin(), told.end());
          rounds.push_back(told.size());
        },
        [this](const PortStatus& status) {
          ports.push_back(status);
          if (status.open && on_open) on_open();
        });
  }
  void start_and_open() {
    start();
    ASSERT_TRUE(run_until([this] { return !ports.empty() && ports.back().open; }));
  }
  /// Runs the core until `condition` holds; false after a generous time without.
  [[nodiscard]] bool run_until(const std::function<bool()>& condition) {
    const auto give_up = monotonic_now() + 2 * ample;
    while (!condition()) {
      if (monotonic_now() > give_up) return false;
      io_.run_one_for(milliseconds(5));
    }
    return true;
  }
  ExchangeResult next_result() {
    const auto count = results.size() + 1;
    EXPECT_TRUE(run_until([&] { return results.size() >= count; })) << "no result came";
    return results.empty() ? ExchangeResult{} : results.back();
  }
  ExchangeResult run(const Exchange& exchange) {
    worker->arm(exchange);
    return next_result();
  }
  /// Lets the worker go once around its loop, so that bytes already said have been noticed.
  void let_worker_notice() {
    for (int turn = 0; turn < 3; ++turn) {
      const auto before = worker->last_progress();
      ASSERT_TRUE(run_until([&] { return worker->last_progress() != before; }));
    }
  }

 private:
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{io_.get_executor()};

 public:
  std::vector<ExchangeResult> results;
  std::vector<std::size_t> rounds;  ///< how many results were told together
  std::vector<PortStatus> ports;
  std::function<void()> on_open;
  std::unique_ptr<RtuWorker> worker;
};

}  // namespace axisd::modbus_rtu::test
