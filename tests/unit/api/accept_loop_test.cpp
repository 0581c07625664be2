// Connections on their way through the accept loop, to a gRPC that does nothing with them by itself.
#include "api/transport/accept_loop.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "api/transport/listen.hpp"
#include "tests/support/stream_socket.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using transport::AcceptLoop;
using transport::StreamBudget;

constexpr ssize_t hello = transport::PeerBudgets::hello;

class Acceptance : public ::testing::Test {
 protected:
  void serve(const transport::PeerBudgets::Limits& limits = {}) {
    auto sockets = transport::listen_on("127.0.0.1:0", false);
    ASSERT_TRUE(sockets) << to_string(sockets.error());
    port_ = sockets->front().port;
    std::vector<AcceptLoop::Entry> entries;
    entries.push_back({.socket = std::move(sockets->front()), .hand_over = [this](FileDescriptor connection) {
                         const std::lock_guard taking(taking_);
                         const std::lock_guard lock(mutex_);
                         taken_.push_back(std::move(connection));
                       }});
    ASSERT_TRUE(loop_.start(std::move(entries), limits, {}, {}));
  }

  [[nodiscard]] FileDescriptor client() const {
    auto ours = test::stream_socket();
    const sockaddr_in address{.sin_family = AF_INET,
                              .sin_port = htons(static_cast<std::uint16_t>(port_)),
                              .sin_addr = {htonl(INADDR_LOOPBACK)},
                              .sin_zero = {}};
    EXPECT_EQ(::connect(ours.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return ours;
  }
  static void send(const FileDescriptor& client, ssize_t bytes) {
    const std::string text(static_cast<std::size_t>(bytes), 'x');
    EXPECT_EQ(::send(client.get(), text.data(), text.size(), MSG_NOSIGNAL), bytes);
  }
  /// Ends both directions at once.
  static void vanish(FileDescriptor client) {
    const linger at_once{.l_onoff = 1, .l_linger = 0};
    setsockopt(client.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  }
  [[nodiscard]] int taken() {
    const std::lock_guard lock(mutex_);
    return static_cast<int>(taken_.size());
  }
  /// What gRPC finds to read on one of them, bytes; that of one which was cut off is gone.
  [[nodiscard]] ssize_t left_on(std::size_t which) {
    const int connection = [&] {
      const std::lock_guard lock(mutex_);
      return taken_.at(which).get();
    }();
    std::string all(200'000, ' ');
    return ::recv(connection, all.data(), all.size(), MSG_PEEK | MSG_DONTWAIT);
  }

  /// Whatever has happened on the connections by now is known to the loop.
  void let_loop_come_round() {
    for (int i = 0; i < 8; ++i) {  // it accepts one at a time
      const auto before = loop_.last_progress();
      EXPECT_TRUE(eventually([&] { return loop_.last_progress() > before; }));
    }
  }

  int port_ = 0;
  std::mutex taking_;  ///< who has it keeps gRPC from taking any
  std::mutex mutex_;
  std::vector<FileDescriptor> taken_;  ///< under mutex_
  AcceptLoop loop_;
};

TEST_F(Acceptance, WhoEndsItsSendingKeepsItsPlaceForAsLongAsGrpcHasIt) {
  serve({.connections = 1});
  const auto first = client();
  send(first, hello);
  ::shutdown(first.get(), SHUT_WR);
  ASSERT_TRUE(eventually([this] { return taken() == 1; }));
  char byte = 0;
  for (int i = 0; i < 20; ++i) {
    const auto other = client();
    EXPECT_LE(::recv(other.get(), &byte, 1, 0), 0);
  }
  ASSERT_EQ(taken(), 1);
  EXPECT_EQ(left_on(0), hello) << "a Stop just before the end is read";
  {
    const std::lock_guard lock(mutex_);
    ::shutdown(taken_.front().get(), SHUT_RDWR);  // as gRPC does
  }
  EXPECT_TRUE(eventually([&] {
    const auto other = client();
    // It stays until it is taken, or turned away.
    while (taken() < 2 && ::recv(other.get(), &byte, 1, MSG_DONTWAIT) < 0 && errno == EAGAIN)
      block_until(monotonic_now() + std::chrono::milliseconds(1));
    return taken() == 2;
  }));
}

TEST_F(Acceptance, WhatWhoIsGoneHasLeftIsReadUnlessItIsTooMuch) {
  serve();
  constexpr ssize_t little = 4096;
  constexpr ssize_t much =
      (StreamBudget::Limits{}.of_one + 1) * static_cast<ssize_t>(StreamBudget::least_bytes);
  auto small = client();
  ASSERT_TRUE(eventually([this] { return taken() == 1; }));
  auto large = client();
  ASSERT_TRUE(eventually([this] { return taken() == 2; }));
  send(small, little);
  send(large, much);
  ASSERT_TRUE(eventually([&] { return left_on(1) == much; }));
  vanish(std::move(small));
  vanish(std::move(large));
  EXPECT_TRUE(eventually([this] { return left_on(1) <= 0; }));
  EXPECT_EQ(left_on(0), little);
}

/// It may keep what it asked for, as the answers wait for it.
TEST_F(Acceptance, WhoEndsItsSendingAndDoesNotLeaveIsReset) {
  serve({.leaving = std::chrono::milliseconds(50)});
  const auto ours = client(), other = client();
  send(ours, hello);
  ::shutdown(ours.get(), SHUT_WR);
  char byte = 0;
  EXPECT_EQ(::recv(ours.get(), &byte, 1, 0), -1);
  EXPECT_EQ(errno, ECONNRESET);
  EXPECT_EQ(::recv(other.get(), &byte, 1, MSG_DONTWAIT), -1);
  EXPECT_EQ(errno, EAGAIN) << "it may go on sending";
}

/// By a client that sends it and leaves at once, while gRPC is busy with the connection before.
TEST_F(Acceptance, AStopThatWaitsForGrpcIsReadThoughItsClientHasLeft) {
  serve();
  constexpr ssize_t stop = 200;
  {
    const std::lock_guard busy(taking_);
    const auto first = client();
    auto small = client(), silent = client();
    send(small, stop);
    vanish(std::move(small));
    vanish(std::move(silent));
    let_loop_come_round();
  }
  ASSERT_TRUE(eventually([this] { return taken() == 2; }));
  EXPECT_EQ(left_on(1), stop);
  let_loop_come_round();
  EXPECT_EQ(taken(), 2) << "of who has said nothing there is nothing to read";
}

/// Others of its address have nearly used up what they all may send: a Stop just before the end is read.
TEST_F(Acceptance, WhoLeavesLittlePaysForNobodyElse) {
  constexpr ssize_t stop = 200;
  constexpr double burst = 10'000;
  serve({.rate = 1, .burst = burst});
  const auto other = client();
  ASSERT_TRUE(eventually([this] { return taken() == 1; }));
  auto small = client();
  ASSERT_TRUE(eventually([this] { return taken() == 2; }));
  send(other, static_cast<ssize_t>(burst) - 100);
  ASSERT_TRUE(eventually([this] { return left_on(0) == static_cast<ssize_t>(burst) - 100; }));
  send(small, stop);
  vanish(std::move(small));
  EXPECT_TRUE(eventually([this] { return left_on(0) <= 0 || left_on(1) <= 0 || left_on(1) == stop; }));
  EXPECT_EQ(left_on(1), stop);
}

}  // namespace
}  // namespace axisd::testing
