// Addresses, the accept loop and TLS.
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "api/server/callers.hpp"
#include "buses/file_descriptor.hpp"
#include "tests/support/stream_socket.hpp"
#include "tests/unit/api/certificates.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using server::Server;
using server::ServerOptions;
using ::testing::HasSubstr;

/// The status of one Stop, and the identity that the server saw.
std::pair<grpc::Status, std::string> stop(const std::shared_ptr<grpc::Channel>& channel) {
  Call context;
  v1::StopRequest request;
  request.set_axis("feeder");
  v1::StopResponse response;
  auto status = v1::AxisService::NewStub(channel)->Stop(&context, request, &response);
  return {status, response.command().client()};
}

class Transport : public ::testing::Test {
 protected:
  Result<int> start(ServerOptions options) {
    server_ = std::make_unique<Server>(machine_, std::move(options));
    return server_->start();
  }
  Reason refused(ServerOptions options) {
    const auto result = start(std::move(options));
    EXPECT_FALSE(result);
    message_ = result ? "" : to_string(result.error());
    return result ? Reason::internal : result.error().reason;
  }
  FakeMachine machine_;
  TemporaryDirectory directory_;
  std::unique_ptr<Server> server_;
  std::string message_;
};

TEST_F(Transport, TcpOnLoopback) {
  const auto port = start({.listen = {"127.0.0.1:0"}});
  ASSERT_TRUE(port) << to_string(port.error());
  const auto [status, client] = stop(connect("127.0.0.1:" + std::to_string(*port)));
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(client, "local:localhost");
}

TEST_F(Transport, SecondDaemonOnTheSameAddressFails) {
  const auto path = "unix:" + (directory_ / "axisd.sock");
  const auto port = start({.listen = {"127.0.0.1:0", path}});
  ASSERT_TRUE(port);
  const auto running = std::move(server_);
  EXPECT_EQ(refused({.listen = {"127.0.0.1:" + std::to_string(*port)}}), Reason::busy);
  EXPECT_THAT(message_, HasSubstr("another program listens there"));
  EXPECT_EQ(refused({.listen = {path}}), Reason::busy);
  EXPECT_TRUE(stop(connect(path)).first.ok());
}

TEST_F(Transport, UnixSocketLeftBehindIsReplaced) {
  const auto file = directory_ / "axisd.sock";
  {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    file.copy(address.sun_path, sizeof address.sun_path - 1);
    const FileDescriptor dead(socket(AF_UNIX, SOCK_STREAM, 0));
    ASSERT_GE(dead.get(), 0);
    ASSERT_EQ(bind(dead.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ASSERT_TRUE(std::filesystem::exists(file));
  ASSERT_TRUE(start({.listen = {"unix:" + file}}));
  EXPECT_TRUE(stop(connect("unix:" + file)).first.ok());
  server_.reset();
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST_F(Transport, PlaintextStaysOnTheHostAndAddressesAreChecked) {
  EXPECT_EQ(refused({.listen = {"0.0.0.0:0"}}), Reason::invalid_argument);
  EXPECT_THAT(message_, HasSubstr("plaintext"));
  EXPECT_EQ(refused({.listen = {"[::]:0"}}), Reason::invalid_argument);
  for (const auto* wrong :
       {"7443", ":7443", "localhost:", "localhost:http", "localhost:70000", "::1:7443", "unix:"})
    EXPECT_EQ(refused({.listen = {wrong}}), Reason::invalid_argument) << wrong;
}

TEST_F(Transport, NothingIsUnpacked) {
  const auto port = start({.listen = {"127.0.0.1:0"}});
  ASSERT_TRUE(port) << to_string(port.error());
  const auto axes = v1::AxisService::NewStub(connect("127.0.0.1:" + std::to_string(*port)));
  for (const auto packed : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE, GRPC_COMPRESS_NONE}) {
    Call context;
    context.set_compression_algorithm(packed);
    v1::ListAxesRequest request;
    v1::ListAxesResponse response;
    const auto status = axes->ListAxes(&context, request, &response);
    EXPECT_EQ(status.error_code(),
              packed == GRPC_COMPRESS_NONE ? grpc::StatusCode::OK : grpc::StatusCode::UNIMPLEMENTED)
        << packed << ": " << status.error_message();
  }
}

TEST_F(Transport, SurvivesRunningOutOfDescriptors) {
  const auto port = start({.listen = {"127.0.0.1:0"}});
  ASSERT_TRUE(port);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(*port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  constexpr int crowd = 8;
  std::vector<FileDescriptor> clients;
  clients.reserve(crowd);
  for (int i = 0; i < crowd; ++i) clients.emplace_back(test::stream_socket());

  const int lowest_free = dup(0);
  close(lowest_free);
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  auto none_left = before;
  none_left.rlim_cur = static_cast<rlim_t>(lowest_free);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none_left), 0);
  int turned_away = 0;
  for (const auto& client : clients) {
    EXPECT_EQ(connect(client.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    char byte = 0;
    if (recv(client.get(), &byte, 1, 0) <= 0) ++turned_away;
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(turned_away, crowd);
  clients.clear();
  EXPECT_TRUE(stop(connect("127.0.0.1:" + std::to_string(*port))).first.ok());
}

TEST_F(Transport, ConnectionsAreBounded) {
  const auto port = start({.listen = {"127.0.0.1:0"}, .peers = {.connections = 8, .idle = 1h}});
  ASSERT_TRUE(port);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(*port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::vector<FileDescriptor> clients;
  // Surplus connections are closed without a word; gRPC greets the others with its settings.
  constexpr std::string_view hello("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0",
                                   transport::PeerBudgets::hello);
  bool turned_away = false;
  for (int i = 0; i < 200 && !turned_away; ++i) {
    auto& client = clients.emplace_back(test::stream_socket());
    ASSERT_EQ(connect(client.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    (void)send(client.get(), hello.data(), hello.size(), MSG_NOSIGNAL);
    char byte = 0;
    turned_away = recv(client.get(), &byte, 1, 0) <= 0;
  }
  EXPECT_TRUE(turned_away);
  EXPECT_EQ(clients.size(), 7U) << "an address has six of eight";
  clients.clear();
  EXPECT_TRUE(eventually([&] { return stop(connect("127.0.0.1:" + std::to_string(*port))).first.ok(); }));
}

TEST_F(Transport, SilentConnectionsMakeRoom) {
  const auto port = start({.listen = {"127.0.0.1:0"}, .peers = {.connections = 8}});
  ASSERT_TRUE(port);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(*port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const auto before = connect("127.0.0.1:" + std::to_string(*port));
  ASSERT_TRUE(stop(before).first.ok());
  std::vector<FileDescriptor> crowd;
  for (int i = 0; i < 100; ++i) {
    auto& client = crowd.emplace_back(test::stream_socket());
    ASSERT_EQ(connect(client.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  EXPECT_TRUE(stop(connect("127.0.0.1:" + std::to_string(*port))).first.ok()) << "whoever comes behind them";
  EXPECT_TRUE(stop(before).first.ok()) << "and whoever was there before";
}

/// HTTP/2 rapid reset: requests that are taken back at once (CVE-2023-44487).
TEST_F(Transport, AFloodOfRequestsThatAreTakenBackIsCutOff) {
  // So little that a slow computer reads more.
  const auto port = start({.listen = {"127.0.0.1:0"}, .peers = {.rate = 4096, .burst = 32 * 1024}});
  ASSERT_TRUE(port);
  const auto honest = connect("127.0.0.1:" + std::to_string(*port));
  ASSERT_TRUE(stop(honest).first.ok());
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(*port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const auto flood = test::stream_socket();
  ASSERT_EQ(::connect(flood.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  const auto frame = [](char kind, char flags, std::uint32_t stream, std::string_view payload) {
    std::string bytes{0, 0, static_cast<char>(payload.size()), kind, flags};
    for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(stream >> shift);
    return bytes + std::string(payload);
  };
  std::string bytes = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(4, 0, 0, "");
  const std::string path = "/axisd.v1.SystemService/GetInfo";
  const auto headers = std::string("\x83\x86\x04", 3) + static_cast<char>(path.size()) + path;
  bool cut_off = false;
  std::array<char, 65536> answers{};
  for (std::uint32_t stream = 1; stream < 200'000'000 && !cut_off;) {
    if (bytes.size() < 100'000)
      for (int i = 0; i < 200; ++i, stream += 2)
        bytes += frame(1, 4, stream, headers) + frame(3, 0, stream, std::string_view("\0\0\0\x08", 4));
    pollfd ready{.fd = flood.get(), .events = POLLIN | POLLOUT, .revents = 0};
    ASSERT_GT(poll(&ready, 1, 10'000), 0);
    const auto got = recv(flood.get(), answers.data(), answers.size(), MSG_DONTWAIT);
    const auto sent = send(flood.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent > 0) bytes.erase(0, static_cast<std::size_t>(sent));
    cut_off = got == 0 || (sent < 0 && errno != EAGAIN);
  }
  EXPECT_TRUE(cut_off);
  EXPECT_TRUE(stop(honest).first.ok()) << "of the same address, and goes on";
}

class Tls : public Transport {
 protected:
  ServerOptions options() { return options(certificates_.served()); }
  static ServerOptions options(std::shared_ptr<tls::Live> live) {
    return {.listen = {"127.0.0.1:0"}, .tls = std::move(live)};
  }
  void SetUp() override {
    Certificates::set_clock(machine_);
    certificates_.make_ca("ca");
    certificates_.make_pair("server", "ca");
    certificates_.make_pair("hmi-1", "ca");
  }

  Certificates certificates_{directory_};
};

TEST_F(Tls, OnlyVerifiedClientsAreServedByTheirName) {
  certificates_.make_ca("stranger-ca");
  certificates_.make_pair("intruder", "stranger-ca");
  const auto port = start(options());
  ASSERT_TRUE(port) << to_string(port.error());
  const auto target = "127.0.0.1:" + std::to_string(*port);
  const auto [status, name] = stop(connect(target, certificates_.client("hmi-1")));
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(name, "hmi-1");
  EXPECT_FALSE(stop(connect(target, certificates_.client("intruder"))).first.ok());
  EXPECT_FALSE(stop(connect(target, certificates_.client(""))).first.ok());
  EXPECT_FALSE(stop(connect(target)).first.ok());
  EXPECT_EQ(machine_.submitted().size(), 1U);
}

TEST_F(Tls, AUnixSocketBesideItNeedsNoCertificate) {
  const auto path = "unix:" + (directory_ / "axisd.sock");
  ASSERT_TRUE(start({.listen = {"127.0.0.1:0", path}, .tls = certificates_.served()}));
  const auto [status, name] = stop(connect(path));
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(name, own_name());
}

/// No address lets such a call in: where one does by mistake, it gets nothing.
TEST_F(Tls, ACallWithoutACertificateIsRefused) {
  server::Callers callers(machine_, nullptr, nullptr);
  const grpc::CallbackServerContext context;
  EXPECT_TRUE(callers.admit(context, v1::StopRequest())) << "there is no TLS";
  callers.trust(certificates_.served());
  for (const auto& refused :
       {callers.admit(context, v1::StopRequest()), callers.admit(context, v1::ListAxesRequest())}) {
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().reason, Reason::unauthenticated);
    EXPECT_EQ(to_string(refused.error()), "no certificate was shown; connect with one");
  }
}

TEST_F(Tls, NewConnectionsGetNewFilesAndOldOnesStay) {
  const auto live = certificates_.served();
  const auto port = start(options(live));
  ASSERT_TRUE(port) << to_string(port.error());
  const auto target = "127.0.0.1:" + std::to_string(*port);
  const auto old = connect(target, certificates_.client("hmi-1"));
  ASSERT_TRUE(stop(old).first.ok());
  const auto before = certificates_.read("server.crt");

  std::ofstream(directory_ / "server.crt") << "nonsense";
  const auto damaged = live->reload();
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().message, HasSubstr("server.crt: no certificate in PEM format"));
  EXPECT_TRUE(stop(connect(target, certificates_.client("hmi-1"))).first.ok()) << "what was served stays";

  // Another authority for both sides: only whoever trusts that one gets in from now on.
  certificates_.make_ca("ca");
  certificates_.make_pair("server", "ca");
  const auto stranger = certificates_.client("hmi-1");
  certificates_.make_pair("hmi-2", "ca");
  ASSERT_TRUE(live->reload().value_or(false));
  EXPECT_FALSE(live->reload().value_or(true)) << "nothing has changed";
  EXPECT_TRUE(stop(connect(target, certificates_.client("hmi-2"))).first.ok());
  EXPECT_FALSE(stop(connect(target, stranger)).first.ok());
  EXPECT_NE(before, live->served()->contents.certificate);
  // The old connection is there, but its client's authority is trusted no more.
  EXPECT_EQ(stop(old).first.error_code(), grpc::StatusCode::UNAUTHENTICATED);
}

TEST_F(Tls, NothingIsTakenFromARevokedClientStopsIncluded) {
  auto files = certificates_.server_files();
  files.crl = directory_ / "ca.crl";
  certificates_.revoke("ca", {});
  const auto live = Certificates::served(files);
  const auto port = start(options(live));
  ASSERT_TRUE(port) << to_string(port.error());
  const auto target = "127.0.0.1:" + std::to_string(*port);
  const auto old = connect(target, certificates_.client("hmi-1"));
  ASSERT_TRUE(stop(old).first.ok());
  Call watching;
  const auto watch = v1::AxisService::NewStub(old)->WatchAxes(&watching, v1::WatchAxesRequest());
  v1::WatchAxesResponse seen;
  ASSERT_TRUE(watch->Read(&seen));

  certificates_.revoke("ca", {"hmi-1"});
  ASSERT_TRUE(live->reload().value_or(false));
  for (const auto& channel : {old, connect(target, certificates_.client("hmi-1"))}) {
    const auto status = stop(channel).first;
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_THAT(status.error_message(), HasSubstr("the certificate of hmi-1 was revoked (2"));
    EXPECT_EQ(detail_of(status).reason(), v1::REASON_UNAUTHENTICATED);
  }
  while (watch->Read(&seen)) {
  }
  EXPECT_EQ(watch->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(machine_.submitted().size(), 1U);
}

TEST_F(Tls, AClockThatStepsBackTakesNoStopAway) {
  const auto port = start(options());
  ASSERT_TRUE(port) << to_string(port.error());
  const auto channel = connect("127.0.0.1:" + std::to_string(*port), certificates_.client("hmi-1"));
  ASSERT_TRUE(stop(channel).first.ok());
  machine_.set_now(machine_.now() - 48h);
  const auto [status, name] = stop(channel);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(name, "hmi-1");
  EXPECT_EQ(machine_.submitted().size(), 2U);
}

TEST_F(Tls, AnExpiredClientHasNoRightOnItsOpenConnection) {
  const auto port = start(options());
  ASSERT_TRUE(port) << to_string(port.error());
  const auto channel = connect("127.0.0.1:" + std::to_string(*port), certificates_.client("hmi-1"));
  ASSERT_TRUE(stop(channel).first.ok());
  machine_.set_now(machine_.now() + 72h);
  const auto status = stop(channel).first;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(status.error_message(), HasSubstr("the certificate of hmi-1 has expired (2"));
  EXPECT_EQ(machine_.submitted().size(), 1U);
}

}  // namespace
}  // namespace axisd::testing
