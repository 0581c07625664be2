#include "api/axisctl/interrupt.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <system_error>

namespace axisd::axisctl {
namespace {

// A handler can reach only globals: the eventfd of each Interrupt that exists, the outer one first.
std::array<std::atomic<int>, 2> requests{-1, -1};

void on_signal(int /*number*/) {
  const int saved = errno;
  const std::uint64_t one = 1;
  for (const auto& request : requests)
    // eventfd's counter cannot be full here, and there is nobody to tell.
    if (const int fd = request; fd >= 0) [[maybe_unused]]
      const auto written = ::write(fd, &one, sizeof one);
  errno = saved;
}

std::atomic<int>& free_place() { return requests[0] < 0 ? requests[0] : requests[1]; }

void handle(void (*handler)(int)) {
  struct sigaction action{};
  action.sa_handler = handler;
  // The second signal meets the default action: whoever is in a hurry gets out.
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // The terminal is gone. Whoever ignores that (nohup) goes on ignoring it.
  struct sigaction present{};
  if (sigaction(SIGHUP, nullptr, &present) == 0 && present.sa_handler != SIG_IGN)
    sigaction(SIGHUP, &action, nullptr);
}

int new_eventfd() {
  const int fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  return fd;
}

}  // namespace

Interrupt::Interrupt(std::function<void()> action)
    : request_(new_eventfd()), closing_(new_eventfd()), action_(std::move(action)) {
  free_place() = request_;
  handle(on_signal);
  thread_ = std::thread([this] {
    std::array<pollfd, 2> fds{{{request_, POLLIN, 0}, {closing_, POLLIN, 0}}};
    while (poll(fds.data(), fds.size(), -1) < 0 && errno == EINTR) {
    }
    if ((fds[0].revents & POLLIN) != 0) action_();
  });
}

Interrupt::~Interrupt() {
  const bool outer = requests[0] == request_;
  (outer ? requests[0] : requests[1]) = -1;
  handle(outer ? SIG_DFL : on_signal);
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(closing_, &one, sizeof one);
  thread_.join();
  close(closing_);
  close(request_);
}

bool Interrupt::requested() const { return wait_for(std::chrono::milliseconds(0)); }

bool Interrupt::wait_for(std::chrono::milliseconds limit) const {
  pollfd fd{request_, POLLIN, 0};
  // A signal that interrupts the wait has made the eventfd readable, so the repeat returns at once.
  int ready = poll(&fd, 1, static_cast<int>(limit.count()));
  if (ready < 0) ready = poll(&fd, 1, 0);
  return ready > 0;
}

}  // namespace axisd::axisctl
