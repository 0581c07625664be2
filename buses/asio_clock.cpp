#include "buses/asio_clock.hpp"

#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace axisd {
namespace {

int made_timer() {
  const int fd = ::timerfd_create(CLOCK_BOOTTIME, TFD_NONBLOCK | TFD_CLOEXEC);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "timerfd_create");
  return fd;
}

void set_timer(int fd, TimePoint when) {
  constexpr Duration::rep ns_per_second = 1'000'000'000;
  // 0 would switch it off.
  const auto ns = std::max<Duration::rep>(Duration(when.time_since_epoch()).count(), 1);
  const itimerspec setting{.it_interval = {},
                           .it_value = {.tv_sec = ns / ns_per_second, .tv_nsec = ns % ns_per_second}};
  if (::timerfd_settime(fd, TFD_TIMER_ABSTIME, &setting, nullptr) != 0)
    throw std::system_error(errno, std::generic_category(), "timerfd_settime");
}

}  // namespace

AsioClock::AsioClock(boost::asio::io_context& io, Served served)
    : timer_(io, made_timer()), served_(served) {}

WallTime AsioClock::wall(TimePoint t) const {
  return std::chrono::system_clock::now() +
         std::chrono::duration_cast<std::chrono::system_clock::duration>(t - monotonic_now());
}

bool AsioClock::serve(TimePoint now) {
  if (next_due() > now) return false;
  serving_ = true;
  run_due(now);
  serving_ = false;
  return true;
}

void AsioClock::schedule(TimePoint) {
  if (served_ == Served::by_io_context && !serving_) wake_in_time();
}

void AsioClock::wake_in_time() {
  const auto next = next_due();
  // To wake once too early costs no more than to put the timer off each time that a callback is cancelled.
  if (next >= wakes_at_) return;
  // Before the waiting begins: a timer that has run out is readable until it is set again.
  set_timer(timer_.native_handle(), next);
  wakes_at_ = next;
  if (waiting_) return;
  waiting_ = true;
  timer_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                    [this](const boost::system::error_code& error) {
                      if (!error) on_wake();
                    });
}

void AsioClock::on_wake() {
  waiting_ = false;
  wakes_at_ = TimePoint::max();
  if (served_ == Served::by_loop) return;
  serve(now());
  wake_in_time();
}

}  // namespace axisd
