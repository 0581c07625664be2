// A lease that is renewed while a program goes on.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "api/axisctl/client.hpp"

namespace axisd::axisctl::commission {

/// Acquires the lease of one axis and renews it on a thread of its own. If this program hangs or dies, the
/// lease ends by itself and the axis does what `on_lease_loss` says. Thread: any.
class HeldLease {
 public:
  /// Throws Failure if the axis cannot be had.
  HeldLease(const Client& client, const std::string& axis, const std::string& label);
  HeldLease(const HeldLease&) = delete;
  HeldLease& operator=(const HeldLease&) = delete;
  /// Releases it.
  ~HeldLease();

  [[nodiscard]] std::uint64_t token() const { return token_; }
  /// Why it is over; empty: it is not, as far as is known.
  [[nodiscard]] std::string lost() const;

 private:
  void renew_until_closed();

  const Client& client_;
  std::uint64_t token_ = 0;
  std::chrono::milliseconds pause_{};
  mutable std::mutex mutex_;
  std::condition_variable closing_changed_;
  bool closing_ = false;
  std::string lost_;
  std::thread thread_;
};

}  // namespace axisd::axisctl::commission
