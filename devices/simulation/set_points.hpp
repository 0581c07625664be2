// The hand-over of set-points in profile position mode (CiA 402): what was acknowledged, and what waits.
#pragma once

#include <optional>
#include <utility>

#include "buses/clock.hpp"
#include "devices/simulation/motion.hpp"

namespace axisd::simulation {

/// `Buffered`: how the drive keeps a set-point that begins when the one before is reached.
template <class Buffered>
class SetPoints {
 public:
  /// Bit 12 is up, or will be.
  [[nodiscard]] bool acknowledged() const { return acknowledged_; }
  /// When bit 12 shows that.
  [[nodiscard]] TimePoint shown_from() const { return shown_from_; }
  void acknowledge(TimePoint shown_from = {}) {
    acknowledged_ = true;
    shown_from_ = shown_from;
  }
  void end_acknowledgement() { acknowledged_ = false; }
  /// Bit 4 fell: another one may be given as soon as none waits.
  void start_fell() {
    if (!buffered_) acknowledged_ = false;
  }

  /// Interrupted by a halt, or given during halt.
  void suspend(Plan plan) { suspended_ = std::move(plan); }
  [[nodiscard]] std::optional<Plan> take_suspended() { return std::exchange(suspended_, std::nullopt); }
  void drop_suspended() { suspended_.reset(); }

  void buffer(Buffered next) { buffered_ = std::move(next); }
  /// The one before is reached. The buffer is free again as soon as its set-point is under way; `start`:
  /// bit 4.
  [[nodiscard]] std::optional<Buffered> take_buffered(bool start) {
    if (buffered_ && !start) acknowledged_ = false;
    return std::exchange(buffered_, std::nullopt);
  }
  void drop_buffered() { buffered_.reset(); }
  /// Nothing waits any more.
  void drop_all() {
    suspended_.reset();
    buffered_.reset();
  }

 private:
  bool acknowledged_ = false;
  TimePoint shown_from_{};
  std::optional<Plan> suspended_;
  std::optional<Buffered> buffered_;
};

}  // namespace axisd::simulation
