// What the kernel knows of the other end of a connection.
#pragma once

#include <sys/socket.h>

#include <string>

#include "api/transport/peer_budgets.hpp"

namespace axisd::transport {

/// The address by which a peer is counted: an IPv4 address, the first 64 bit of an IPv6 address, "localhost"
/// for all by which a computer reaches itself, or the user at the other end of a unix socket.
[[nodiscard]] std::string address_of_peer(int connection);
/// The same, of an IPv4 or IPv6 address. Empty: it is none.
[[nodiscard]] std::string counted_address(const sockaddr_storage& peer);
/// What the kernel has counted on it; nothing for unix sockets.
[[nodiscard]] PeerBudgets::Traffic traffic_of(int connection);

}  // namespace axisd::transport
