#include "buses/clock.hpp"

#include <sys/prctl.h>

#include <cerrno>
#include <ctime>

namespace axisd {

Clock::Timer Clock::call_at(TimePoint when, std::function<void()> callback) {
  const auto id = ++last_id_;
  const bool earliest = pending_.empty() || when < pending_.begin()->first.first;
  pending_.emplace(Key{when, id}, std::move(callback));
  due_.emplace(id, when);
  if (earliest) schedule(when);
  return {this, id};
}

TimePoint Clock::run_due(TimePoint now) {
  while (!pending_.empty() && pending_.begin()->first.first <= now) {
    auto node = pending_.extract(pending_.begin());
    due_.erase(node.key().second);
    node.mapped()();
  }
  return next_due();
}

TimePoint Clock::next_due() const {
  return pending_.empty() ? TimePoint::max() : pending_.begin()->first.first;
}

void Clock::cancel(std::uint64_t id) {
  const auto found = due_.find(id);
  if (found == due_.end()) return;
  pending_.erase(Key{found->second, id});
  due_.erase(found);
}

// Not CLOCK_MONOTONIC, which stands still while the computer is suspended: what was accepted before that is
// late after it (M31), and leases are over.
TimePoint monotonic_now() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return TimePoint(std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec));
}

void block_until(TimePoint when) {
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(when.time_since_epoch()).count();
  const timespec deadline{.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_BOOTTIME, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

void use_precise_waits() { prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL); }

}  // namespace axisd
