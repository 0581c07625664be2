// Tells rest from motion where a drive measures: position and velocity waver at rest, too (M30).
#pragma once

#include <cstdint>
#include <optional>

#include "buses/clock.hpp"

namespace axisd::cia402 {

/// A velocity up to this may be noise of any drive, r/min: it proves neither rest nor motion.
inline constexpr int velocity_noise_rpm = 1;
/// A drive's own threshold (606Fh) counts up to this, r/min: templates and forgotten settings are beyond.
inline constexpr int most_velocity_noise_rpm = 30;

/// Pulses from one reading of the counter to another: it wraps.
constexpr std::int64_t way_between(std::int32_t from, std::int32_t to) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from));
}

/// Pure. A velocity beyond its noise is a motion. Below, the drive's own word counts; where it has none, the
/// position does: at rest it stays within half of the in-position window, or where it is, if it is exact. How
/// long it must do so after a motion follows from the slowest one, 1 r/min. So it is, too, where a velocity
/// is noise by the drive's own threshold alone: that it rests is not taken from its word then.
///
/// What settles still turns a little where the drive takes it for in position, and its noise comes on top: a
/// shaft that was at rest, and is by the drive's own word, goes on resting for some readings that are little
/// faster than noise, as long as its position stays. Where its rest was doubted meanwhile, the same readings
/// leave the doubt as it is.
class Standstill {
 public:
  struct Look {
    TimePoint at{};
    std::int32_t position = 0;
    int velocity_rpm = 0;
    std::optional<bool> told{};  ///< by the drive: it moves, or rests; nothing: it does not say
  };
  /// What positions mean, pulses; `window`: Drive::position_window(), 0 where they are exact.
  struct Gauge {
    std::int64_t window = 1, pulses_per_revolution = 1;
    int noise_rpm = velocity_noise_rpm;  ///< up to which a velocity may be noise
  };

  /// Takes a look. True: it moves.
  bool moves(const Look& look, const Gauge& gauge);
  void forget() { *this = {}; }
  /// It may have begun to move unseen, below the noise: rest has to be shown anew.
  void doubt() {
    if (!doubted_) rested_ = moves_ ? std::nullopt : since_;
    since_.reset();
    unsettled_ = 0;
    moves_ = doubted_ = true;
  }
  /// It moves only as far as it has not shown its rest since doubt(): neither speed nor way tell so.
  [[nodiscard]] bool doubted() const { return doubted_; }

 private:
  bool note(const Look& look, bool moves);
  [[nodiscard]] bool settles(const Look& look, const Gauge& gauge) const;

  std::optional<Look> since_;   ///< it was there, and as it is
  std::optional<Look> rested_;  ///< in doubt: it was at rest there before
  bool moves_ = false;
  bool doubted_ = false;
  int unsettled_ = 0;  ///< readings in a row that settles() was asked about
};

}  // namespace axisd::cia402
