// By which address a peer is counted.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

#include "api/transport/peer_socket.hpp"

namespace axisd::testing {
namespace {

using transport::counted_address;

std::string of_ipv4(const char* text) {
  sockaddr_storage peer{};
  auto* address = reinterpret_cast<sockaddr_in*>(&peer);
  address->sin_family = AF_INET;
  EXPECT_EQ(inet_pton(AF_INET, text, &address->sin_addr), 1) << text;
  return counted_address(peer);
}
std::string of_ipv6(const char* text) {
  sockaddr_storage peer{};
  auto* address = reinterpret_cast<sockaddr_in6*>(&peer);
  address->sin6_family = AF_INET6;
  EXPECT_EQ(inet_pton(AF_INET6, text, &address->sin6_addr), 1) << text;
  return counted_address(peer);
}

TEST(PeerAddress, IsThatOfAComputer) {
  EXPECT_EQ(of_ipv4("10.1.2.3"), "10.1.2.3");
  EXPECT_EQ(of_ipv6("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::");
  EXPECT_EQ(of_ipv6("2001:db8:1:2:ffff::1"), "2001:db8:1:2::") << "which has as many of them as it likes";
  EXPECT_NE(of_ipv6("2001:db8:1:3::1"), "2001:db8:1:2::");
  EXPECT_EQ(of_ipv6("::ffff:10.1.2.3"), "::ffff:10.1.2.3");
}

TEST(PeerAddress, AComputersOwnAreOne) {
  for (const auto* text : {"127.0.0.1", "127.0.0.2", "127.255.1.1"}) EXPECT_EQ(of_ipv4(text), "localhost");
  for (const auto* text : {"::1", "::ffff:127.0.0.1", "::ffff:127.9.9.9"})
    EXPECT_EQ(of_ipv6(text), "localhost");
}

TEST(PeerAddress, AUnixSocketHasNone) {
  sockaddr_storage peer{};
  peer.ss_family = AF_UNIX;
  EXPECT_EQ(counted_address(peer), "");
}

}  // namespace
}  // namespace axisd::testing
