// The page's server, over loopback.
#include "api/exposition/http_server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <atomic>
#include <string>
#include <vector>

#include "tests/support/stream_socket.hpp"

namespace axisd::metrics {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

constexpr HttpServer::Limits quick = {.connections = 4,
                                      .pause = std::chrono::milliseconds(2),
                                      .request = std::chrono::milliseconds(50),
                                      .response = std::chrono::seconds(5)};

class HttpServerTest : public testing::Test {
 protected:
  HttpServerTest() {
    auto opened = HttpServer::open(
        "127.0.0.1:0", false,
        [this](Format format) {
          ++pages_;
          return std::make_shared<const std::string>(format == Format::text ? "the text\n"
                                                                            : "open metrics\n");
        },
        quick);
    EXPECT_TRUE(opened) << to_string(opened.error());
    server_ = *std::move(opened);
  }
  [[nodiscard]] FileDescriptor connected() const {
    auto socket = test::stream_socket();
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<std::uint16_t>(server_->port()));
    EXPECT_EQ(connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    return socket;
  }
  /// All that comes until the connection ends.
  static std::string rest(const FileDescriptor& socket) {
    std::string all;
    char piece[4096];
    for (ssize_t count = 0; (count = recv(socket.get(), piece, sizeof piece, 0)) > 0;)
      all.append(piece, static_cast<std::size_t>(count));
    return all;
  }
  [[nodiscard]] std::string ask(const std::string& request) const {
    const auto socket = connected();
    send(socket.get(), request.data(), request.size(), MSG_NOSIGNAL);
    return rest(socket);
  }

  std::atomic<int> pages_ = 0;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpServerTest, ServesThePageInTheFormThatIsAskedFor) {
  const auto text = ask("GET /metrics HTTP/1.1\r\nHost: here\r\n\r\n");
  EXPECT_THAT(text, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(text, HasSubstr("Content-Type: text/plain; version=0.0.4; charset=utf-8\r\n"));
  EXPECT_THAT(text, HasSubstr("Connection: close\r\n"));
  EXPECT_THAT(text, EndsWith("\r\n\r\nthe text\n"));
  const auto open =
      ask("GET /metrics?x=1 HTTP/1.1\r\nHost: here\r\nAccept: "
          "application/openmetrics-text;version=1.0.0,*/*;q=0.1\r\n\r\n");
  EXPECT_THAT(open,
              HasSubstr("Content-Type: application/openmetrics-text; version=1.0.0; charset=utf-8\r\n"));
  EXPECT_THAT(open, EndsWith("\r\n\r\nopen metrics\n"));
}

TEST_F(HttpServerTest, ServesNothingElse) {
  EXPECT_THAT(ask("GET / HTTP/1.1\r\nHost: here\r\n\r\n"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(ask("POST /metrics HTTP/1.1\r\nHost: here\r\nContent-Length: 0\r\n\r\n"),
              StartsWith("HTTP/1.1 405 "));
  const auto head = ask("HEAD /metrics HTTP/1.1\r\nHost: here\r\n\r\n");
  EXPECT_THAT(head, HasSubstr("Content-Length: 9\r\n"));
  EXPECT_THAT(head, EndsWith("\r\n\r\n"));
  EXPECT_EQ(ask("no HTTP at all\r\n\r\n"), "");
  EXPECT_EQ(ask("GET /metrics HTTP/1.1\r\nHost: " + std::string(20'000, 'x') + "\r\n\r\n"), "");
}

TEST_F(HttpServerTest, ConnectionsThatSayNothingMakeRoom) {
  std::vector<FileDescriptor> silent;
  for (std::size_t i = 0; i < quick.connections; ++i) silent.push_back(connected());
  EXPECT_THAT(ask("GET /metrics HTTP/1.1\r\nHost: here\r\n\r\n"), EndsWith("the text\n"));
  EXPECT_EQ(rest(silent.front()), "");
}

TEST_F(HttpServerTest, AFloodIsServedAtItsPace) {
  const auto begun = monotonic_now();
  constexpr int scrapes = 10;
  for (int i = 0; i < scrapes; ++i)
    EXPECT_THAT(ask("GET /metrics HTTP/1.1\r\nHost: here\r\n\r\n"), EndsWith("the text\n"));
  EXPECT_GE(monotonic_now() - begun, (scrapes - 1) * quick.pause);
  EXPECT_EQ(pages_, scrapes);
}

TEST_F(HttpServerTest, WhatIsBeyondThisComputerHasToBeMeant) {
  const auto page = [](Format) { return std::make_shared<const std::string>(); };
  const auto refused = HttpServer::open("0.0.0.0:0", false, page, quick);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::invalid_argument);
  EXPECT_TRUE(HttpServer::open("0.0.0.0:0", true, page, quick));
  const auto taken = HttpServer::open(fmt::format("127.0.0.1:{}", server_->port()), false, page, quick);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().reason, Reason::busy);
  EXPECT_THAT(taken.error().remedy, HasSubstr("server.metrics.listen"));
}

}  // namespace
}  // namespace axisd::metrics
