// The shaft of an axis, as the readings of its drive show it.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "buses/signal.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/position_tracker.hpp"
#include "devices/axis/shaft_watch.hpp"
#include "devices/axis/terminal_motion.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// The newest reading, where the shaft is by it, and what moves it without a command. It answers questions:
/// what follows from a reading is decided elsewhere. Thread: core.
class Shaft {
 public:
  /// The context outlives this.
  explicit Shaft(const AxisContext& context);

  /// A new reading.
  void take(const DriveSample& sample) { sample_ = sample; }
  /// Nothing: the drive was not read yet.
  [[nodiscard]] const std::optional<DriveSample>& sample() const { return sample_; }
  /// Notified by a new reading, and when the link changed.
  [[nodiscard]] Signal& sampled() { return sampled_; }

  [[nodiscard]] PositionTracker& tracker() { return tracker_; }
  [[nodiscard]] const PositionTracker& tracker() const { return tracker_; }
  [[nodiscard]] ShaftWatch& watch() { return watch_; }
  [[nodiscard]] const ShaftWatch& watch() const { return watch_; }
  [[nodiscard]] TerminalMotion& terminal_motion() { return terminal_motion_; }
  [[nodiscard]] const TerminalMotion& terminal_motion() const { return terminal_motion_; }

  [[nodiscard]] bool input_active(std::string_view function) const;
  [[nodiscard]] bool limit_active(bool positive) const;
  /// The switch that homing searches for is active; false: not, or the search is the drive's own affair.
  [[nodiscard]] bool on_homing_switch() const;
  [[nodiscard]] bool is_at(const PositionTracker::Target& target) const;
  /// There, or beside it by no more than a measured position may waver (M30).
  [[nodiscard]] bool is_near(const PositionTracker::Target& target) const;
  /// The shaft is elsewhere than it was at `counter`: further than a measurement wavers.
  [[nodiscard]] bool moved_from(std::int64_t counter) const;
  /// Within homing the motor rests between its phases, and goes on. Precondition: there is a reading.
  [[nodiscard]] bool found_in_motion() const;
  /// It may be the first reading of another power cycle.
  [[nodiscard]] bool looks_restarted(const DriveSample& sample) const;

 private:
  const AxisContext& context_;
  std::optional<DriveSample> sample_;
  Signal sampled_;
  PositionTracker tracker_;
  ShaftWatch watch_;
  TerminalMotion terminal_motion_;
};

}  // namespace axisd
