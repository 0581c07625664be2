// The pulse generator of the simulated drive, and the shaft that follows it.
#pragma once

#include <cstdint>

#include "buses/clock.hpp"
#include "devices/simulation/profile.hpp"

namespace axisd::simulation {

/// Positions in pulses. `commanded` is where the pulses sent so far would have brought the shaft, `shaft`
/// where it really is; motions are planned in the former. The counters are both, from the drive's origin.
class Motor {
 public:
  /// Lets time pass. True if a motion ended by itself within it. `follows`: an energised closed loop brings
  /// the shaft to where it should be, unless it is blocked.
  bool advance(TimePoint now, bool follows = false);

  /// Begins a motion, or goes on from the present speed if one in the same direction is under way.
  void move(std::int64_t distance, const Rates& told);
  void run(int direction, const Rates& told);
  /// Brakes with the deceleration of the motion under way (7.6.2: the one set before it started).
  void brake();
  void brake(double deceleration);
  /// Whatever begins from now on is `factor` (> 0) times as fast as it is told to be, its ramps as well: the
  /// unit of its velocities is another one. Distances are as told.
  void run_at(double factor) { factor_ = factor; }
  /// No more pulses. `slips`: the rotor loses the field and turns on for 10 ms at its last speed.
  void stop(bool slips);
  /// The supply is gone: the counter begins at 0 where the shaft stands.
  void power_up();
  void clear_counter() { offset_ = -commanded_; }
  /// Both counters read so many pulses here and now, as long as nothing lags.
  void set_counter(std::int32_t pulses) { offset_ = pulses - commanded_; }
  /// While blocked the shaft stays where it is, and pulses do not turn it.
  void block(bool blocked) { blocked_ = blocked; }
  /// An energised closed loop needs time: its shaft is behind the pulses by speed x `time`, and comes to rest
  /// exponentially. 0: at once. It concerns what an encoder shows (behind()); switches see shaft().
  void follow_within(Duration time) { following_ = std::chrono::duration<double>(time).count(); }
  [[nodiscard]] bool following() const { return following_ > 0; }
  /// The load turns the shaft. `seen`: the counters follow (an encoder); else the origin moves along.
  void push(std::int64_t pulses, bool seen);

  [[nodiscard]] bool moving() const { return moving_; }
  [[nodiscard]] bool braking() const { return moving_ && braking_; }
  [[nodiscard]] int direction() const { return direction_; }  ///< of the last motion, 1 or -1
  [[nodiscard]] double speed() const;                         ///< pulses/s, not signed
  /// Of the shaft, which follows the pulses; pulses/s, signed.
  [[nodiscard]] double shaft_speed() const;
  /// At the speed that the motion is for.
  [[nodiscard]] bool cruising() const;
  [[nodiscard]] bool blocked() const { return blocked_; }
  [[nodiscard]] std::int64_t shaft() const { return commanded_ - lag_; }
  [[nodiscard]] std::int64_t commanded() const { return commanded_; }
  /// Pulses that the shaft is behind, because it is blocked or has slipped.
  [[nodiscard]] std::int64_t lag() const { return lag_; }
  /// Pulses that it is behind beyond that, because it follows with delay; signed.
  [[nodiscard]] double behind() const { return behind_; }
  [[nodiscard]] std::int32_t counter() const { return static_cast<std::int32_t>(commanded_ + offset_); }
  [[nodiscard]] std::int32_t encoder() const { return static_cast<std::int32_t>(shaft() + offset_); }
  /// Pulses that it takes to stop from the present speed with those rates.
  [[nodiscard]] double stopping_distance(const Rates& told) const;
  /// When the motion ends by itself; TimePoint::max() if it does not.
  [[nodiscard]] TimePoint ends() const;
  /// When the shaft gets to `shaft`, which lies ahead; TimePoint::max() if it does not.
  [[nodiscard]] TimePoint reaches(std::int64_t shaft) const;
  /// When the shaft, blocked, is `lag` pulses behind on the side of the motion; TimePoint::max() if never.
  [[nodiscard]] TimePoint lags(std::int64_t lag) const;

 private:
  void begin(int direction, const Profile& profile, const Rates& rates);
  void halt(const Rates& rates);
  [[nodiscard]] Rates really(const Rates& told) const;
  void fall_behind(TimePoint from);
  [[nodiscard]] double elapsed() const;
  [[nodiscard]] TimePoint after(double seconds) const;
  [[nodiscard]] TimePoint commands(std::int64_t position) const;

  TimePoint now_{}, begin_{};
  Profile profile_;
  Rates rates_;
  int direction_ = 1;
  bool moving_ = false, braking_ = false, blocked_ = false;
  std::int64_t commanded_ = 0, lag_ = 0, from_ = 0, offset_ = 0;
  double factor_ = 1;
  double following_ = 0;  ///< seconds
  double behind_ = 0;
};

}  // namespace axisd::simulation
