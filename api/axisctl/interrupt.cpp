#include "api/axisctl/interrupt.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <system_error>

namespace axisd::axisctl {
namespace {

// A handler can reach only globals; Interrupt exists once at a time.
int request_fd = -1;

extern "C" void on_signal(int /*number*/) {
  const int saved = errno;
  const std::uint64_t one = 1;
  // eventfd's counter cannot be full here, and there is nobody to tell.
  [[maybe_unused]] const auto written = ::write(request_fd, &one, sizeof one);
  errno = saved;
}

void handle(void (*handler)(int)) {
  struct sigaction action{};
  action.sa_handler = handler;
  // The second signal meets the default action: whoever is in a hurry gets out.
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int new_eventfd() {
  const int fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  return fd;
}

}  // namespace

Interrupt::Interrupt(std::function<void()> action) : closing_(new_eventfd()), action_(std::move(action)) {
  request_fd = new_eventfd();
  handle(on_signal);
  thread_ = std::thread([this] {
    std::array<pollfd, 2> fds{{{request_fd, POLLIN, 0}, {closing_, POLLIN, 0}}};
    while (poll(fds.data(), fds.size(), -1) < 0 && errno == EINTR) {
    }
    if ((fds[0].revents & POLLIN) != 0) action_();
  });
}

Interrupt::~Interrupt() {
  handle(SIG_DFL);
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(closing_, &one, sizeof one);
  thread_.join();
  close(closing_);
  close(request_fd);
  request_fd = -1;
}

bool Interrupt::requested() const { return wait_for(std::chrono::milliseconds(0)); }

bool Interrupt::wait_for(std::chrono::milliseconds limit) const {
  pollfd fd{request_fd, POLLIN, 0};
  // A signal that interrupts the wait has made the eventfd readable, so the repeat returns at once.
  int ready = poll(&fd, 1, static_cast<int>(limit.count()));
  if (ready < 0) ready = poll(&fd, 1, 0);
  return ready > 0;
}

}  // namespace axisd::axisctl
