// Tells when a homing that was started has ended, and whether at home: 6061h stays at 6, so only the motion
// and the bits tell.
#pragma once

#include <optional>

#include "devices/drive.hpp"

namespace axisd::cia402 {

/// Pure.
///
///   idle --begin()--> homing --at rest with the bit, where a homing leaves the counter--> idle, reached
///                     homing --at rest at one place for `longest_rest`, or released--> idle, reached or not
///                     homing --at rest, and the drive says that it failed--> idle, not reached
///
/// The bit may be left from an earlier homing, by a drive that ignored this start, or that was stopped on its
/// way: it counts once it was seen low, or the motor has moved to where only a homing leads. And with a stop
/// terminal in the way nothing is home. A bit that is never seen at rest but high may be low only because the
/// motor turned: see Start::tied_to_rest.
class HomingWatch {
 public:
  /// Between its phases the motor rests for less than this.
  static constexpr Duration longest_rest = std::chrono::milliseconds(500);

  /// What a sample does not say.
  struct Signs {
    bool low = false;      ///< the bit itself is 0, whatever the motor does
    bool held_up = false;  ///< a stop terminal is active
    bool failed = false;   ///< the drive says so
  };

  struct Start {
    std::optional<std::int32_t> from{};  ///< where the motor stood
    std::int32_t offset = 0;             ///< 607Ch
    std::int32_t braking = 0;            ///< pulses that it may turn on beyond the switch
    std::int64_t window = 0;             ///< Drive::position_window()
    /// Before the start the bit was high, and CiA 402's own: while the motor turns it says nothing, so that a
    /// stop which nobody saw (a pulse at a terminal) would make it rise.
    bool tied_to_rest = false;
    /// Before the start the bit was low, at rest: once it is high it has risen for this homing, however short
    /// that was.
    bool was_low = false;
    /// Home is where the motor stands: nothing moves, and where the counter is 0 it is home, whoever did it.
    /// `braking` and a wide `window` do not count then.
    bool in_place = false;
  };

  void begin(TimePoint at, Start start);
  void end() { began_.reset(); }
  /// The drive was seen to have begun it, between two samples.
  void note_begun() { moved_ = true; }
  /// Takes a sample, and says whether homing goes on.
  bool goes_on(const DriveSample& sample, Signs signs);
  [[nodiscard]] bool active() const { return began_.has_value(); }
  /// It has ended at home.
  [[nodiscard]] bool reached() const { return reached_; }

 private:
  [[nodiscard]] bool at_home(std::int32_t position, std::int64_t tolerance) const;
  [[nodiscard]] bool near(std::int32_t position, std::int32_t other) const;

  std::optional<TimePoint> began_;
  Start start_;
  bool was_low_ = false, moved_ = false, held_up_ = false, reached_ = false;
  TimePoint resting_since_{};
  std::int32_t resting_at_ = 0;
  bool rests_ = false;
};

}  // namespace axisd::cia402
