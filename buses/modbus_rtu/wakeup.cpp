#include "buses/modbus_rtu/wakeup.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <system_error>

namespace axisd::modbus_rtu {

timespec to_timespec(Duration duration) {
  const auto ns = std::max(duration, Duration::zero()).count();
  return {.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
}

Wakeup::Wakeup() : descriptor_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (descriptor_ < 0) throw std::system_error(errno, std::system_category(), "eventfd");
}

Wakeup::~Wakeup() { close(descriptor_); }

void Wakeup::notify() { eventfd_write(descriptor_, 1); }

void Wakeup::drain() {
  eventfd_t ignored = 0;
  eventfd_read(descriptor_, &ignored);
}

void Wakeup::wait(Duration limit) {
  pollfd watched{.fd = descriptor_, .events = POLLIN, .revents = 0};
  const auto timeout = to_timespec(limit);
  if (ppoll(&watched, 1, &timeout, nullptr) > 0) drain();
}

}  // namespace axisd::modbus_rtu
