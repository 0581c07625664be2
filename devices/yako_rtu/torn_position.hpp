// The two words of the position, 0x000A and 0x000B, where the drive reads them at two moments.
#pragma once

#include <cstdint>
#include <optional>

#include "buses/clock.hpp"

namespace axisd::yako_rtu {

/// Whether a reading's two words may be of two moments. No manual says that they are of one: with a carry
/// between them the reading is wrong by 65536, in one direction or the other. Such a step is told from a
/// motion where the motor cannot make it in the time between two readings. Pure. Thread: core.
class TornPosition {
 public:
  /// Pulses per second, the most that the drive can do; > 0.
  explicit TornPosition(double highest_rate) : highest_rate_(highest_rate) {}

  /// This reading is 65536 away from where the shaft can be after the one that was believed last, or from
  /// where it was then, however long ago; without one, from 0.
  [[nodiscard]] bool suspects(std::int32_t position, TimePoint measured_at) const;
  /// It was asked for at `asked_at`, and is taken for true.
  void believe(std::int32_t position, TimePoint asked_at);
  /// The counter means something else now.
  void forget() { believed_.reset(); }

  /// The position by a suspect reading and the one right after it. A shaft that wavers about a carry may tear
  /// both, in one direction and in the other; else the second is right.
  [[nodiscard]] static std::int32_t of_two(std::int32_t suspect, std::int32_t second);

 private:
  struct Believed {
    std::int32_t position = 0;
    TimePoint asked_at;
  };
  double highest_rate_;
  std::optional<Believed> believed_;
};

}  // namespace axisd::yako_rtu
