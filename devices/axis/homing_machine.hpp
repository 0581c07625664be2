// Following a homing, which the drive does by itself, to its end (M21).
#pragma once

#include <cstdint>
#include <optional>

#include "buses/clock.hpp"
#include "devices/drive.hpp"
#include "devices/units/scale.hpp"

namespace axisd {

/// Judges the readings of a homing that was started. The drive's bit alone proves nothing, it may be left
/// from the last time: homing mode must have been seen, and either the bit's rise, or the counter standing
/// where only a completed homing puts it. Pure. Thread: core.
///
///   starting  -- homing mode, or the bit has risen -----------------> searching
///   starting  -- neither, by a reading from after the start window -> did_not_start
///   searching -- at rest, and the mode has ended:
///                  the bit has risen -------------------------------> home
///                  the bit is set, and the counter at home ---------> home, unless a stop terminal is active
///                  the bit is set, and a measured counter not yet --> settling, for a while
///                  else --------------------------------------------> not_reached
///   settling  -- as searching
///   starting, searching -- further from its origin than max_travel -> too_far
///   starting, searching -- its time is over -----------------------> took_too_long
class HomingMachine {
 public:
  enum class State : std::uint8_t {
    starting,
    searching,
    settling,  ///< the drive has ended it, and the shaft is on its way to where that is
    home,
    // It has ended otherwise:
    not_reached,
    did_not_start,
    too_far,
    took_too_long,
  };
  struct Homing {
    TimePoint since{};  ///< its start was acknowledged
    Duration timeout{};
    bool homed_before = false;           ///< the drive's bit was set when it was started
    std::int64_t offset_pulses = 0;      ///< the compensation, to which the counter may be set at home
    std::int64_t window = 0;             ///< pulses within which a measured position wavers; 0: it is counted
    double fastest = 0;                  ///< pulses per second
    std::optional<double> max_travel{};  ///< user units
    std::int64_t origin = 0;             ///< unwrapped counter at its start
    TimePoint asked_at{};                ///< of the newest reading then
  };
  struct Reading {
    DriveSample sample;
    std::int64_t counter = 0;  ///< unwrapped
    bool held_up = false;      ///< by a stop terminal
  };

  HomingMachine(const Homing& homing, const Scale& scale);

  State look(const Reading& reading, TimePoint now);
  [[nodiscard]] State state() const { return state_; }
  /// By then it has ended.
  [[nodiscard]] TimePoint latest() const { return homing_.since + homing_.timeout; }

 private:
  [[nodiscard]] State judge_rest(const Reading& reading, TimePoint now);
  [[nodiscard]] bool goes_too_far(const Reading& reading);
  [[nodiscard]] std::int64_t near() const;

  Homing homing_;
  Scale scale_;
  State state_ = State::starting;
  bool bit_was_low_;                      ///< since it was started
  std::optional<TimePoint> rests_since_;  ///< it was first seen to have ended
  std::int64_t origin_, previous_;  ///< counters; the origin goes along where the drive sets its counter
  TimePoint previous_asked_;
};

}  // namespace axisd
