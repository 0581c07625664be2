// The pulse generator of the simulated drive, and the shaft that follows it.
#pragma once

#include <cstdint>

#include "buses/clock.hpp"
#include "devices/yako_rtu/simulator_profile.hpp"

namespace axisd::yako_rtu {

/// Positions in pulses. `shaft` is where the machine really is, `counter` what the drive believes.
class Motor {
 public:
  /// Lets time pass. True if a motion ended by itself within it.
  bool advance(TimePoint now);

  /// Begins a motion, or goes on from the present speed if one in the same direction is under way.
  void move(std::int64_t distance, const Rates& rates);
  void run(int direction, const Rates& rates);
  /// Brakes with the deceleration of the motion under way (7.6.2: the one set before it started).
  void brake();
  void brake(double deceleration);
  /// No more pulses. `slips`: the rotor loses the field and turns on for 10 ms at its last speed.
  void stop(bool slips);
  /// The supply is gone: the counter begins at 0 where the shaft stands.
  void power_up() { offset_ = -shaft_; }
  void clear_counter() { offset_ = -shaft_; }

  [[nodiscard]] bool moving() const { return moving_; }
  [[nodiscard]] bool braking() const { return moving_ && braking_; }
  [[nodiscard]] int direction() const { return direction_; }  ///< of the last motion, 1 or -1
  [[nodiscard]] double speed() const;                         ///< pulses/s, not signed
  [[nodiscard]] std::int64_t shaft() const { return shaft_; }
  [[nodiscard]] std::int32_t counter() const { return static_cast<std::int32_t>(shaft_ + offset_); }
  /// Pulses that it takes to stop from the present speed with `rates`.
  [[nodiscard]] double stopping_distance(const Rates& rates) const;
  /// When the motion ends by itself; TimePoint::max() if it does not.
  [[nodiscard]] TimePoint ends() const;
  /// When the shaft gets to `shaft`, which lies ahead; TimePoint::max() if it does not.
  [[nodiscard]] TimePoint reaches(std::int64_t shaft) const;

 private:
  void begin(int direction, const Profile& profile, const Rates& rates);
  [[nodiscard]] double elapsed() const;
  [[nodiscard]] TimePoint after(double seconds) const;

  TimePoint now_{}, begin_{};
  Profile profile_;
  Rates rates_;
  int direction_ = 1;
  bool moving_ = false, braking_ = false;
  std::int64_t shaft_ = 0, from_ = 0, offset_ = 0;
};

}  // namespace axisd::yako_rtu
