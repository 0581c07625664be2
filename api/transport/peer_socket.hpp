// What the kernel knows of the other end of a connection.
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <string>

#include "api/transport/peer_budgets.hpp"

namespace axisd::transport {

/// The address by which a peer is counted: an IPv4 address, the first 64 bit of an IPv6 address, "localhost"
/// for all by which a computer reaches itself, or the user at the other end of a unix socket.
[[nodiscard]] std::string address_of_peer(int connection);
/// The same, of an IPv4 or IPv6 address. Empty: it is none.
[[nodiscard]] std::string counted_address(const sockaddr_storage& peer);
/// How gRPC names a peer on TCP, to its port ("ipv4:127.0.0.1:40000"); empty: it is not on TCP.
[[nodiscard]] std::string grpc_name_of_peer(int connection);
/// Ends it with all that was not read yet. After a shutdown gRPC would still read what comes, for as long as
/// the peer goes on.
void reset(int connection);
/// Until let_go() nobody is told that there is something to read on it, unless there is no room for more, or
/// the peer has ended it. Without effect on unix sockets.
void hold_back(int connection);
void let_go(int connection);
/// Bytes that have come and were not read yet.
[[nodiscard]] std::uint64_t unread_on(int connection);
/// What the kernel has counted on it; nothing for unix sockets.
[[nodiscard]] PeerBudgets::Traffic traffic_of(int connection);

}  // namespace axisd::transport
