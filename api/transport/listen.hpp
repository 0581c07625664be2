// Listening sockets.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "api/transport/knock.hpp"
#include "buses/error.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::transport {

/// One listening socket. A unix socket's file is removed with it.
struct ListeningSocket {
  FileDescriptor fd;
  int port = 0;                  ///< of TCP
  std::string unix_path;         ///< empty: TCP
  std::shared_ptr<Knock> knock;  ///< whoever accepts tells it of everybody

  ListeningSocket() = default;
  ListeningSocket(ListeningSocket&&) = default;
  ListeningSocket& operator=(ListeningSocket&&) = default;
  ~ListeningSocket();
};

/// Listens on "HOST:PORT", "[IPV6]:PORT" or "unix:PATH"; a host name with several addresses gives several
/// sockets. Port 0 takes a free one. Without `remote_allowed` only loopback addresses and unix sockets are
/// accepted. Another daemon on the same address is an error, never shared silently. Blocks for name
/// resolution. Errors: invalid_argument, busy (in use), offline (the system refuses the address).
[[nodiscard]] Result<std::vector<ListeningSocket>> listen_on(const std::string& address, bool remote_allowed);

/// Two ends of one connection within the daemon; both closed: out of descriptors. Non-blocking.
[[nodiscard]] std::pair<FileDescriptor, FileDescriptor> connected_pair();

}  // namespace axisd::transport
