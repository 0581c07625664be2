// What a reading says of the shaft beside where it is: can the position still be believed (M20)?
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "buses/clock.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// Finds in the readings what costs the position its trust, also what began and ended between two of them.
/// Pure. Thread: core.
///
///   seen   -- lose_sight(): the drive fell silent --> unseen
///   unseen -- see(): it is online again ------------> seen
class ShaftWatch {
 public:
  enum class State : std::uint8_t { seen, unseen };
  /// What of the axis decides together with a reading.
  struct Facts {
    bool inverted = false;
    bool closed_loop = false;
    bool counts_released = false;  ///< the position follows a shaft that is turned while it is released
    bool homes = false;            ///< a homing of ours is being executed
    bool ours = false;             ///< a motion of ours has begun, or may go on after its command
    bool positive_limit = false;   ///< active, as are
    bool negative_limit = false;
    bool quick_stop = false;
    bool homing_terminal = false;  ///< a terminal is configured to start homing
    std::int64_t window = 0;       ///< pulses by which a measured position may differ
    std::int64_t noise = 0;        ///< pulses by which two readings at rest may differ (M30)
    Duration settling{};           ///< how late a measured position comes to its target
  };

  /// The newest reading. The two questions below follow it.
  void look(const DriveSample& now, const Facts& facts);
  /// It shows that the position is not to be believed: homing that is not ours zeroes the counter, and in
  /// open loop the overtravel stop at a limit has no ramp. Homing runs onto limits by design.
  [[nodiscard]] bool shows_loss(const std::optional<DriveSample>& before, const DriveSample& now,
                                const Facts& facts) const;
  /// Between the two readings something may have ended that costs the position its trust, and neither of them
  /// shows it. `turned_by`: pulses, from one to the other.
  [[nodiscard]] bool hides_loss(const DriveSample& before, const DriveSample& now, std::int64_t turned_by,
                                const Facts& facts) const;

  /// The drive's counter is being zeroed: what is read meanwhile may show either counter.
  void begin_rezeroing() { rezeroing_ = true; }
  void end_rezeroing() { rezeroing_ = false; }
  /// `ends`: counters at which the shaft may come to rest if nothing disturbs it.
  void lose_sight(std::vector<std::int64_t> ends);
  void see() { state_ = State::seen; }

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool rezeroes() const { return rezeroing_; }
  /// Direction of the axis in which it moved last.
  [[nodiscard]] bool positive() const { return positive_; }
  /// A shaft that is found there was not out of sight, or needs not have been disturbed meanwhile.
  [[nodiscard]] bool undisturbed_at(std::int64_t counter) const;

 private:
  [[nodiscard]] static bool limit(const Facts& facts, bool positive) {
    return positive ? facts.positive_limit : facts.negative_limit;
  }
  [[nodiscard]] bool ended_abruptly(const DriveSample& before, const DriveSample& now, std::int64_t turned_by,
                                    const Facts& facts) const;
  [[nodiscard]] bool homed_unseen(const DriveSample& before, const DriveSample& now, std::int64_t turned_by,
                                  const Facts& facts) const;

  State state_ = State::seen;
  std::vector<std::int64_t> ends_;  ///< of what was out of sight
  bool rezeroing_ = false;
  bool positive_ = true;
  TimePoint ours_until_{};  ///< what turned the shaft before was told to, or settles after it
};

}  // namespace axisd
