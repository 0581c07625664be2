// The socket of axisd-link: one request and one answer per connection, a line each.
#pragma once

#include <sys/types.h>

#include <chrono>

#include "buses/file_descriptor.hpp"
#include "daemon/link/links.hpp"

namespace axisd::link {

class Server {
 public:
  /// `listener`: a listening unix stream socket. `user`: besides root, who may ask.
  Server(FileDescriptor listener, uid_t user, Links links)
      : listener_(std::move(listener)), user_(user), links_(std::move(links)) {}

  /// Serves one connection, or what is owed to a link; waits for either.
  void serve_one();

 private:
  /// Longest that a client may take; others wait meanwhile.
  static constexpr auto patience = std::chrono::seconds(1);

  Result<void> answer(int client);
  Result<void> check_peer(int client) const;

  FileDescriptor listener_;
  uid_t user_;
  Links links_;
};

}  // namespace axisd::link
