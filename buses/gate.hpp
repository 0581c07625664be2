// The one gate that every motion frame passes (design rule: a pure function decides at the bind).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "buses/stop_notice.hpp"

namespace axisd {

/// How urgently an axis is to stop; a higher one replaces a lower one that is still pending.
enum class StopKind : std::uint8_t { none, halt, stop, quick_stop };

/// The motion epoch of one axis. Thread: any (atomics only).
///
/// The epoch rises with every stop, halt, disable, lease loss, offline, reboot and reload. A motion frame
/// that was prepared in an older epoch is never sent.
class AxisGate {
 public:
  AxisGate() = default;
  /// `bus`: told of each stop that is requested; may be null.
  explicit AxisGate(std::shared_ptr<StopNotice> bus) : bus_(std::move(bus)) {}

  [[nodiscard]] std::uint64_t epoch() const { return epoch_.load(std::memory_order_acquire); }
  /// Makes every motion frame prepared until now unsendable. The new epoch.
  std::uint64_t raise() { return epoch_.fetch_add(1, std::memory_order_acq_rel) + 1; }

  /// The lane of stops: raises the epoch at once, so that the very next bind already refuses motion. The
  /// caller must wake the core thread, which serves the stop. First the count, then the epoch: whoever still
  /// saw no pending stop has read an epoch that this makes old.
  void request_stop() {
    if (bus_) bus_->give();
    pending_stops_.fetch_add(1, std::memory_order_acq_rel);
    raise();
  }
  /// Stops were requested that the core has not served yet: nothing new may be accepted before them.
  [[nodiscard]] bool stop_pending() const { return pending_stops_.load(std::memory_order_acquire) > 0; }
  /// Thread: core. One stop that was asked for by request_stop() has been passed on to its bus.
  void stop_passed_on() {
    if (bus_) bus_->take();
  }
  /// Thread: core. One stop is being served (also one that came without request_stop()).
  void stop_served() {
    auto pending = pending_stops_.load(std::memory_order_acquire);
    while (pending > 0 &&
           !pending_stops_.compare_exchange_weak(pending, pending - 1, std::memory_order_acq_rel)) {
    }
  }

  /// Of the lease that the axis is commanded under; 0: of none.
  [[nodiscard]] std::uint64_t fencing_token() const { return fencing_token_.load(std::memory_order_acquire); }
  [[nodiscard]] TimePoint lease_expires() const { return lease_expires_.load(std::memory_order_acquire); }
  /// Motion that was given under another token, and any under this one from `expires` on, is not sent: the
  /// latter also if the core is late to end the lease. First the token, then the time, and they are read the
  /// other way round: a frame under the old token never meets the new time.
  void set_fencing_token(std::uint64_t token, TimePoint expires = TimePoint::max()) {
    fencing_token_.store(token, std::memory_order_release);
    lease_expires_.store(expires, std::memory_order_release);
  }

 private:
  std::shared_ptr<StopNotice> bus_;
  std::atomic<std::uint64_t> epoch_{1};
  std::atomic<std::uint64_t> fencing_token_{0};
  std::atomic<TimePoint> lease_expires_{TimePoint::max()};
  std::atomic<int> pending_stops_{0};
};

/// What a motion frame carries to its bind.
struct MotionGuard {
  /// As fencing_token: of what everybody may do whoever leases the axis (disable it).
  static constexpr std::uint64_t needs_no_lease = ~std::uint64_t{0};
  /// As fencing_token: of what goes on after its lease, and starts nothing more. No gate ever has it.
  static constexpr std::uint64_t lease_is_over = needs_no_lease - 1;

  std::shared_ptr<const AxisGate> gate;  ///< null: not a motion frame, always sendable
  std::uint64_t epoch = 0;
  std::uint64_t fencing_token = 0;         ///< 0: given without a lease
  TimePoint not_after = TimePoint::max();  ///< validity of the request
  /// Of the other members of a group: what forbids one of them to start forbids it to this one, too (M22).
  std::shared_ptr<const std::vector<MotionGuard>> with{};
};

enum class Verdict : std::uint8_t { send, superseded, expired, lease_lost };

/// may_send() for one axis, whatever its group says. Pure.
inline Verdict may_send_alone(const MotionGuard& guard, TimePoint now) {
  if (!guard.gate) return Verdict::send;
  if (guard.gate->epoch() != guard.epoch) return Verdict::superseded;
  if (now > guard.not_after) return Verdict::expired;
  if (guard.fencing_token == MotionGuard::needs_no_lease) return Verdict::send;
  const auto expires = guard.gate->lease_expires();
  if (guard.gate->fencing_token() != guard.fencing_token) return Verdict::lease_lost;
  if (guard.fencing_token != 0 && now >= expires) return Verdict::lease_lost;
  return Verdict::send;
}

/// Decides, at the moment a frame would go out, whether it still may. Pure.
inline Verdict may_send(const MotionGuard& guard, TimePoint now) {
  auto verdict = may_send_alone(guard, now);
  if (!guard.gate || !guard.with) return verdict;
  for (const auto& other : *guard.with)
    if (verdict == Verdict::send) verdict = may_send_alone(other, now);
  return verdict;
}

}  // namespace axisd
