#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "buses/clock.hpp"
#include "devices/axis/stop_holds.hpp"
#include "devices/event.hpp"
#include "devices/persistence.hpp"

namespace axisd::core {

/// Who holds which axis (M14), by name: also of axes that a reload exchanges, or that the configuration no
/// longer has. A hold counts at once, and ends once that is durable. Thread: core.
class StopHoldKeeper {
 public:
  using Tell = std::function<void(const std::string& axis, EventContent)>;
  using Done = std::function<void(Result<void>)>;
  /// What waits for the disk waits no longer than this; the hold then says that it is not durable yet.
  static constexpr auto longest_wait = std::chrono::seconds(1);

  /// Takes over what `persistence` has loaded; it may be null: then nothing outlives the daemon. `changed`:
  /// publish the axis again.
  StopHoldKeeper(Clock& clock, Persistence* persistence, Tell tell,
                 std::function<void(std::string_view axis)> changed);

  /// Of an axis; the same object for as long as this lives.
  [[nodiscard]] const StopHolds* of(const std::string& axis) { return &holds_[axis]; }

  /// Never refused. `settled` (may be empty) is called once: when the hold is durable, cannot be, or has not
  /// become it within longest_wait. Does not publish: the stop does.
  void add(const std::string& axis, HoldKey key, TimePoint arrived, std::function<void()> settled);
  /// Errors: invalid_argument (there is none that is meant: says who holds), stopping (it was held anew
  /// meanwhile), storage (the holds stand).
  void release(const std::string& axis, const HoldRelease& release, Done done);

 private:
  void saved(const std::string& axis, const HoldKey& key, bool fresh, const Result<void>& result);
  [[nodiscard]] Result<void> end(const std::string& axis, const std::vector<StopHold>& meant,
                                 const std::string& by);

  Clock* clock_;
  Persistence* persistence_;
  Tell tell_;
  std::function<void(std::string_view)> changed_;
  std::map<std::string, StopHolds> holds_;
  std::map<std::uint64_t, Clock::Timer> waits_;  ///< of what waits for the disk
  std::uint64_t last_wait_ = 0;
  std::shared_ptr<int> alive_ = std::make_shared<int>();  ///< the disk may answer when this is gone
};

}  // namespace axisd::core
