// Patience with readers, and its end.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "buses/clock.hpp"

namespace axisd::server {

/// A stream that may have to wait for its reader. Thread: reply.
class Stallable {
 public:
  virtual ~Stallable() = default;
  /// Nothing: no write is pending.
  [[nodiscard]] virtual std::optional<TimePoint> writing_since() const = 0;
  /// The daemon is shutting down: there is less patience.
  [[nodiscard]] virtual bool closing() const = 0;
  /// Fails the pending write, which ends the stream.
  virtual void cancel() = 0;
};

/// Cancels streams whose reader does not read, so that none of them holds a bus or the shutdown.
/// Thread: reply.
class StallGuard {
 public:
  explicit StallGuard(Duration limit) : limit_(limit) {}

  /// A write of the stream has begun; it is looked at until none is pending.
  void watch(std::weak_ptr<Stallable> stream);
  /// Looks at the streams that are due; returns when it wants to be called again.
  TimePoint tick(TimePoint now);

 private:
  const Duration limit_;
  TimePoint next_ = TimePoint::max();
  std::vector<std::weak_ptr<Stallable>> streams_;
};

}  // namespace axisd::server
