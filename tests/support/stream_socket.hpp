#pragma once

#include <sys/socket.h>

#include <cerrno>
#include <system_error>

#include "buses/file_descriptor.hpp"

namespace axisd::test {

/// A stream socket that is neither bound nor connected. Throws where the kernel gives none.
inline FileDescriptor stream_socket(int family = AF_INET) {
  const int fd = ::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "socket");
  return FileDescriptor(fd);
}

}  // namespace axisd::test
