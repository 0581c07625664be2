// Clients that open streams and leave them, on a real server: who does it is cut off, and nobody else.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <list>

#include "api/transport/stream_budget.hpp"
#include "api/transport/stream_counts.hpp"
#include "axisd/v1/event_service.grpc.pb.h"
#include "tests/support/stream_socket.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using transport::StreamCounts;
using Limits = transport::StreamBudget::Limits;

std::string frame(char kind, char flags, std::uint32_t stream, const std::string& payload) {
  std::string bytes(9, '\0');
  const auto size = static_cast<std::uint32_t>(payload.size());
  bytes[1] = static_cast<char>(size >> 8U), bytes[2] = static_cast<char>(size);
  bytes[3] = kind, bytes[4] = flags;
  const auto number = htonl(stream);
  bytes.replace(5, 4, reinterpret_cast<const char*>(&number), 4);
  return bytes + payload;
}

/// A field that both ends keep in their tables.
std::string kept(const std::string& name, const std::string& value) {
  return '\x40' + std::string(1, static_cast<char>(name.size())) + name + static_cast<char>(value.size()) +
         value;
}

/// A client that says its hello, acknowledges nothing, and opens streams of 15 bytes without their message.
class Leaver {
 public:
  /// `own`: the address that it comes from; nullptr: any.
  Leaver(const sockaddr* address, socklen_t size, const sockaddr* own = nullptr)
      : socket_(test::stream_socket(address->sa_family)) {
    const int on = 1;
    if (own != nullptr) {
      setsockopt(socket_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
      EXPECT_EQ(::bind(socket_.get(), own, size), 0);
    }
    EXPECT_EQ(::connect(socket_.get(), address, size), 0);
    send("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(4, 0, 0, "") +
         frame(1, 4, 1,
               "\x83\x86" + kept(":path", "/axisd.v1.SystemService/GetInfo") + kept(":authority", "a") +
                   kept("content-type", "application/grpc") + kept("te", "trailers")));
  }
  /// That many more.
  void open(int streams) {
    std::string frames;
    for (int i = 0; i < streams; ++i) frames += frame(1, 4, next_ += 2, "\x83\x86\xc1\xc0\xbf\xbe");
    send(frames);
  }
  /// It sends no more, and listens until the other end has ended, too. True: that had nothing to say.
  [[nodiscard]] bool is_turned_away() {
    ::shutdown(socket_.get(), SHUT_WR);
    char bytes[4096];
    bool said_nothing = true;
    while (::recv(socket_.get(), bytes, sizeof bytes, 0) > 0) said_nothing = false;
    return said_nothing;
  }
  /// Ends it at once, so that another one may come from its port.
  void vanish() {
    const linger at_once{.l_onoff = 1, .l_linger = 0};
    setsockopt(socket_.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    socket_ = {};
  }
  /// By a reset: gRPC ends those, too, that do not answer its pings, but not so.
  [[nodiscard]] bool is_cut_off() {
    char bytes[4096];
    ssize_t got = 0;
    while ((got = ::recv(socket_.get(), bytes, sizeof bytes, MSG_DONTWAIT)) > 0) {
    }
    if (got < 0 && errno == ECONNRESET) cut_off_ = true;  // it is told once
    return cut_off_;
  }
  [[nodiscard]] sockaddr_storage own_address() const {
    sockaddr_storage own{};
    socklen_t size = sizeof own;
    getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&own), &size);
    return own;
  }

 private:
  void send(const std::string& bytes) {
    (void)::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);  // it may have been cut off
  }
  FileDescriptor socket_;
  bool cut_off_ = false;
  std::uint32_t next_ = 1;
};

/// On both kinds of addresses, which gRPC writes differently.
class StreamFloods : public ::testing::TestWithParam<int> {
 protected:
  void serve(const Limits& limits = {}, const transport::PeerBudgets::Limits& peers = {}) {
    const std::string host = GetParam() == AF_INET ? "127.0.0.1:" : "[::1]:";
    server_ = std::make_unique<server::Server>(machine_,
                                               server::ServerOptions{.listen = {host + "0"},
                                                                     .limits = {.calls = 1000, .streams = 64},
                                                                     .peers = peers,
                                                                     .streams = limits});
    const auto port = server_->start();
    ASSERT_TRUE(port) << to_string(port.error());
    target_ = host + std::to_string(*port);
    if (GetParam() == AF_INET) {
      auto& ipv4 = reinterpret_cast<sockaddr_in&>(address_);
      ipv4 = {.sin_family = AF_INET,
              .sin_port = htons(static_cast<std::uint16_t>(*port)),
              .sin_addr = {htonl(INADDR_LOOPBACK)},
              .sin_zero = {}};
    } else {
      auto& ipv6 = reinterpret_cast<sockaddr_in6&>(address_);
      ipv6 = {};
      ipv6.sin6_family = AF_INET6;
      ipv6.sin6_port = htons(static_cast<std::uint16_t>(*port));
      ipv6.sin6_addr = in6addr_loopback;
    }
  }

  Leaver& leaver(const sockaddr* own = nullptr) {
    return leavers_.emplace_back(reinterpret_cast<const sockaddr*>(&address_),
                                 GetParam() == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6), own);
  }
  [[nodiscard]] auto cut_off() { return std::ranges::count_if(leavers_, &Leaver::is_cut_off); }
  /// How gRPC names a client.
  static std::string name_of(const Leaver& client) {
    const auto own = client.own_address();
    if (own.ss_family == AF_INET)
      return "ipv4:127.0.0.1:" + std::to_string(ntohs(reinterpret_cast<const sockaddr_in&>(own).sin_port));
    return "ipv6:%5B::1%5D:" + std::to_string(ntohs(reinterpret_cast<const sockaddr_in6&>(own).sin6_port));
  }

  FakeMachine machine_;
  std::unique_ptr<server::Server> server_;
  std::string target_;
  sockaddr_storage address_{};
  std::list<Leaver> leavers_;
};

TEST_P(StreamFloods, GrpcIsAskedHowManyAreOpen) {
  serve();
  auto& one = leaver();
  auto& other = leaver();
  one.open(49);
  StreamCounts counts;
  const std::vector peers{name_of(one), name_of(other), std::string("ipv4:127.0.0.1:1")};
  const auto open = [&](std::size_t which) {
    const auto all = counts.of(peers);
    const auto found = all.find(peers[which]);
    return found == all.end() ? -1 : found->second.open();
  };
  EXPECT_TRUE(eventually([&] { return open(0) == 50 && open(1) == 1; }));
  EXPECT_EQ(open(2), -1);
  leavers_.pop_front();
  EXPECT_TRUE(eventually([&] { return open(0) == -1; })) << "it is gone";
  other.open(1);
  EXPECT_TRUE(eventually([&] { return open(1) == 2; }));
}

TEST_P(StreamFloods, ANewConnectionFromAPortThatWasKnownIsCountedAnew) {
  serve();
  StreamCounts counts;
  const std::vector peers{name_of(leaver())};
  const auto own = leavers_.back().own_address();
  const auto open = [&] {
    const auto all = counts.of(peers);
    return all.empty() ? -1 : all.begin()->second.open();
  };
  EXPECT_TRUE(eventually([&] { return open() == 1; }));
  leavers_.back().vanish();
  leaver(reinterpret_cast<const sockaddr*>(&own)).open(2);
  EXPECT_TRUE(eventually([&] { return open() == 3; }));
}

/// Each is gone before anybody looks, and gRPC reads all that it leaves.
TEST_P(StreamFloods, WhatIsSentJustBeforeTheEndCounts) {
  serve({}, {.rate = 4 * 1024, .burst = 256 * 1024});
  bool turned_away = false;
  for (int i = 0; i < 60 && !turned_away; ++i) {
    leavers_.clear();
    leaver().open(2000);
    turned_away = leavers_.back().is_turned_away();
  }
  EXPECT_TRUE(turned_away);
}

TEST_P(StreamFloods, WhoOpensMoreThanOneMayHaveIsCutOff) {
  serve();
  auto& good = leaver();
  good.open(100);
  leaver().open(Limits{}.of_one);
  EXPECT_TRUE(eventually([this] { return leavers_.back().is_cut_off(); }));
  EXPECT_FALSE(good.is_cut_off());
}

TEST_P(StreamFloods, WhereTheyAreTooManyWhoHasMostIsCutOffAndNoCallInProgress) {
  serve();
  // More calls in progress on one connection than anybody else has idle streams: they are none.
  const auto channel = connect(target_);
  const auto axes = v1::AxisService::NewStub(channel);
  const auto events = v1::EventService::NewStub(channel);
  struct Watch {
    Call context;
    std::unique_ptr<grpc::ClientReader<v1::WatchAxesResponse>> reader;
  };
  std::list<Watch> watches;
  v1::WatchAxesResponse batch;
  v1::WatchAxesRequest often;
  often.mutable_period()->set_nanos(50'000'000);
  for (int i = 0; i < 63; ++i) {
    auto& watch = watches.emplace_back();
    watch.reader = axes->WatchAxes(&watch.context, often);
  }
  for (auto& watch : watches) ASSERT_TRUE(watch.reader->Read(&batch));
  Call watching;
  const auto quiet = events->WatchEvents(&watching, {});
  v1::WatchEventsResponse event;
  ASSERT_TRUE(quiet->Read(&event));
  machine_.hold();
  struct Pending {
    Call context;
    v1::ResetRequest request;
    v1::ResetResponse response;
  };
  std::list<Pending> pending;
  std::atomic<int> fine{0}, ended{0};
  constexpr int calls = 900;
  for (int i = 0; i < calls; ++i) {
    auto& call = pending.emplace_back();
    call.request.set_axis("feeder");
    call.request.mutable_options()->set_request_id("r-" + std::to_string(i));
    axes->async()->Reset(&call.context, &call.request, &call.response, [&](const grpc::Status& status) {
      fine += status.ok() ? 1 : 0;
      ++ended;
    });
  }
  ASSERT_TRUE(eventually([this] { return machine_.held() == calls; }));

  constexpr int each = 700;
  while (static_cast<std::int64_t>(leavers_.size()) * each <= Limits{}.lasting) leaver().open(each);
  EXPECT_TRUE(eventually([this] { return cut_off() > 0; }));
  EXPECT_EQ(cut_off(), 1) << "the others are few enough together";

  for (auto& watch : watches) EXPECT_TRUE(watch.reader->Read(&batch));
  machine_.let_go();
  EXPECT_TRUE(eventually([&] { return ended == calls; }));
  EXPECT_EQ(fine, calls);
  EXPECT_EQ(cut_off(), 1) << "nor later";
  for (auto& watch : watches) watch.context.TryCancel();
  watching.TryCancel();
}

/// Many connections with a few streams each, and one on which more pass by than any of them keeps.
TEST_P(StreamFloods, WhoIsBusyKeepsItsConnection) {
  serve({.of_one = 1000, .lasting = 300, .idle = 1500});
  const auto axes = v1::AxisService::NewStub(connect(target_));
  struct Asking {
    std::unique_ptr<Call> context;
    v1::GetAxisRequest request;
    v1::GetAxisResponse response;
  };
  std::list<Asking> asking(250);
  std::atomic<int> good{0}, bad{0}, under_way{0};
  std::atomic<bool> enough{false};
  const std::function<void(Asking&)> ask = [&](Asking& one) {
    one.context = std::make_unique<Call>();
    one.request.set_axis("feeder");
    axes->async()->GetAxis(one.context.get(), &one.request, &one.response, [&](const grpc::Status& status) {
      ++(status.ok() ? good : bad);
      if (enough || !status.ok()) {
        --under_way;
        return;
      }
      ask(one);
    });
  };
  for (auto& one : asking) {
    ++under_way;
    ask(one);
  }
  ASSERT_TRUE(eventually([&] { return good > 1000; }));
  for (int i = 0; i < 60; ++i) leaver().open(5);
  EXPECT_TRUE(eventually([&] { return cut_off() > 0; }));
  const int before = good;
  EXPECT_TRUE(eventually([&] { return good > before + 5000; }));
  EXPECT_LT(cut_off(), 30) << "as few as are enough";
  enough = true;
  EXPECT_TRUE(eventually([&] { return under_way == 0; }));
  EXPECT_EQ(bad, 0);
}

INSTANTIATE_TEST_SUITE_P(Both, StreamFloods, ::testing::Values(AF_INET, AF_INET6),
                         [](const auto& family) { return family.param == AF_INET ? "IPv4" : "IPv6"; });

}  // namespace
}  // namespace axisd::testing
