// Interfaces by rtnetlink, one blocking question at a time.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "buses/can/link_report.hpp"
#include "buses/error.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::link {

class Netlink {
 public:
  /// Errors: the kernel gives no such socket.
  static Result<Netlink> open();

  /// What the kernel says about an interface now. Errors: it does not say.
  Result<can::LinkReport> find(const std::string& interface);
  /// Sets it up or down. Waits as long as its driver takes. Errors: the kernel's.
  Result<void> set_up(const can::LinkReport& link, bool up);

 private:
  explicit Netlink(FileDescriptor socket) : socket_(std::move(socket)) {}
  Result<std::span<const std::byte>> ask(std::span<const std::byte> request, std::span<std::byte> buffer);

  FileDescriptor socket_;
};

}  // namespace axisd::link
