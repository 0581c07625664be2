// What the motor does, by readings that waver: rest, motion, direction.
#pragma once

#include <cstdint>
#include <optional>

#include "devices/cia402/standstill.hpp"
#include "devices/drive.hpp"

namespace axisd::cia402 {

/// Pure. Thread: core.
///
///   any   -- begin() ---------------------------------------> begun
///   begun -- a reading shows it ----------------------------> seen
///   begun -- not within `start_window` ---------------------> rest: it did not start
///   seen  -- a reading at rest -----------------------------> rest
///   any   -- stop(), forget() ------------------------------> rest
class MotionWatch {
 public:
  /// Of a motion that was triggered; one that a terminal starts has none.
  enum class State : std::uint8_t { rest, begun, seen };

  /// How a reading is judged.
  struct Means {
    /// A motion may be slower than its velocity shows: then its way tells. Else the drive's own word.
    bool by_way = false;
    std::optional<bool> told{};  ///< Standstill::Look::told
    Standstill::Gauge gauge{};
  };

  /// A trigger went out, or may have.
  void begin(TimePoint at);
  /// By its target it will turn so, until a reading shows otherwise.
  void turns(bool negative) { negative_ = negative; }
  /// `may_run`: something else may turn the shaft.
  void stop(bool may_run);
  /// It may have begun to move unseen.
  void doubt() { standstill_.doubt(); }
  /// The counter has jumped, and not the shaft.
  void counter_jumped();
  /// The drive was switched off and on.
  void forget();

  /// Takes a reading, in order; corrects its motion, velocity and direction. What is measured wavers: a
  /// little of it is no motion, and has no direction. What has to show its rest first moves without a
  /// velocity. Where positions are exact they know better than the drive's own word, which may be that it is
  /// near its target.
  void take(DriveSample& sample, const Means& means);

  [[nodiscard]] State state() const { return state_; }
  /// By the last reading.
  [[nodiscard]] bool moves() const { return moves_; }
  /// Of the last reading of this power cycle, pulses.
  [[nodiscard]] const std::optional<std::int32_t>& position() const { return position_; }

 private:
  void note_direction(const DriveSample& sample, std::int64_t window);
  void note_state(const DriveSample& sample);

  State state_ = State::rest;
  TimePoint since_{};  ///< when it was begun
  Standstill standstill_;
  std::optional<std::int32_t> position_;
  std::optional<std::int32_t> direction_from_;  ///< where the direction was told last
  bool moves_ = false, negative_ = false;
};

}  // namespace axisd::cia402
