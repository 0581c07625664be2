// Speed against time of one motion, as the drives with "start speed" make it (RS-485 manuals 7.1, 7.2;
// YSS-C 6.2.4): trapezoids and triangles, closed form.
#pragma once

#include <array>
#include <cstddef>

namespace axisd::simulation {

/// Speeds in pulses/s, accelerations in pulses/s^2. The sign of a motion is kept elsewhere.
struct Rates {
  double start = 0;  ///< speed at which a motion begins and ends
  double cruise = 0;
  double acceleration = 0;  ///< from start to cruise speed within the acceleration time
  double deceleration = 0;
};

/// Rates from what the registers hold. A time of 0 ms is a jump of the speed.
Rates rates_from(double start_rpm, double cruise_rpm, double acceleration_ms, double deceleration_ms,
                 double pulses_per_revolution);

/// Up to three ramps one after the other; t in seconds from the beginning, distances in pulses.
class Profile {
 public:
  /// Exactly `distance` from the present speed `initial` to standstill; a triangle where the cruise speed is
  /// not reached. Precondition: distance >= stopping_distance(initial, rates).
  static Profile move(double initial, const Rates& rates, double distance);
  /// To the cruise speed (up or down with `acceleration`), then endless.
  static Profile run(double initial, const Rates& rates);
  /// From `initial` to standstill with `deceleration`.
  static Profile halt(double initial, const Rates& rates);
  static double stopping_distance(double initial, const Rates& rates);

  [[nodiscard]] double duration() const { return duration_; }  ///< infinite for run()
  [[nodiscard]] double total() const { return total_; }        ///< infinite for run()
  [[nodiscard]] double distance_at(double t) const;
  [[nodiscard]] double speed_at(double t) const;
  /// How far something that follows with time constant `tau` is behind at `to`, if it was `lag` behind at
  /// `from` (both >= 0, in order; seconds). Exact, so that steps in between change nothing.
  [[nodiscard]] double lag_after(double lag, double from, double to, double tau) const;
  /// When `distance` has been covered; infinite if never.
  [[nodiscard]] double time_at(double distance) const;

 private:
  struct Ramp {
    double begin, distance;  ///< time and distance at its beginning
    double duration, speed, acceleration;
  };
  void add(double duration, double speed, double acceleration);
  [[nodiscard]] const Ramp* ramp_at(double t) const;

  std::array<Ramp, 3> ramps_{};
  std::size_t count_ = 0;
  double duration_ = 0, total_ = 0;
};

}  // namespace axisd::simulation
