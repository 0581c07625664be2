#pragma once

#include <boost/smart_ptr/atomic_shared_ptr.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "devices/event.hpp"
#include "devices/persistence.hpp"

namespace axisd::core {

/// What StopAll latches: nothing on the machine moves before it is released (M14). Thread: core, unless it
/// says otherwise.
///
///   released -- latch() ------------------------------------------------------> latched
///   latched  -- latch(), of whoever was last ---------------------------------> latched
///   latched  -- release() is durable, and nobody has latched it meanwhile ----> released
///
/// It is latched at once, and released once the disk knows.
class MotionInhibit {
 public:
  /// `persistence` may be null: nothing is kept. `tell`: of what stands since the start, and of a latch that
  /// is not durable.
  MotionInhibit(Clock& clock, Persistence* persistence, std::function<void(InhibitChange)> tell);

  /// Tells of what stands since an earlier run.
  void start();
  /// `latched` (may be empty) is called once: when the latch is durable, or with why it is not, or not yet
  /// after StopHoldKeeper::longest_wait.
  void latch(const std::string& client, std::function<void(std::optional<Error>)> latched);
  /// Errors: inhibited (it was latched again meanwhile), those of the disk.
  void release(const std::string& client, std::function<void(Result<void>)> done);

  /// Whether it is latched; the same object for as long as this lives.
  [[nodiscard]] const bool* latched() const { return &latched_; }
  /// Who latched it; nullptr: it is released. Thread: any.
  [[nodiscard]] boost::shared_ptr<const std::string> by() const { return by_.load(); }

 private:
  void set(bool latched, const std::string& by);
  [[nodiscard]] InhibitRecord record(bool active, const std::string& by) const;

  Clock* clock_;
  Persistence* persistence_;
  std::function<void(InhibitChange)> tell_;
  bool latched_ = false;
  int latches_ = 0;                    ///< so far
  std::map<int, Clock::Timer> waits_;  ///< of latches that are not known to be durable yet
  boost::atomic_shared_ptr<const std::string> by_;
  std::shared_ptr<int> alive_ = std::make_shared<int>();  ///< the disk may answer when this is gone
};

}  // namespace axisd::core
