// What the velocities and accelerations of a CiA 402 drive count. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "buses/clock.hpp"

namespace axisd::cia402 {

enum class Angle : std::uint8_t { pulse, revolution, degree, radian };
enum class Per : std::uint8_t { second, minute };

/// One count of a velocity: 10^exponent of `angle` in the time `per`; of an acceleration: that in a second. A
/// pulse is what 6064h counts. The revolution is that of the shaft whose pulses per revolution are
/// configured.
struct Rate {
  Angle angle = Angle::revolution;
  Per per = Per::minute;
  std::int8_t exponent = 0;  ///< -largest_exponent..largest_exponent
  friend bool operator==(const Rate&, const Rate&) = default;
};
inline constexpr int largest_exponent = 9;
inline constexpr Rate revolutions_per_minute{},
    pulses_per_second{.angle = Angle::pulse, .per = Per::second, .exponent = 0};

/// "0.1 r/min", "pulses/s".
std::string text_of(Rate unit);

/// As a configuration names them: pulses per second, then each angle in 10^0 to 10^-3.
inline constexpr std::array<std::string_view, 17> unit_names{"pulses_per_second",
                                                             "rpm",
                                                             "0.1rpm",
                                                             "0.01rpm",
                                                             "0.001rpm",
                                                             "rev_per_second",
                                                             "0.1rev_per_second",
                                                             "0.01rev_per_second",
                                                             "0.001rev_per_second",
                                                             "degrees_per_second",
                                                             "0.1degrees_per_second",
                                                             "0.01degrees_per_second",
                                                             "0.001degrees_per_second",
                                                             "radians_per_second",
                                                             "0.1radians_per_second",
                                                             "0.01radians_per_second",
                                                             "0.001radians_per_second"};
/// Nothing: no unit has this name.
std::optional<Rate> unit_named(std::string_view name);
/// Empty: it has no name.
std::string_view name_of(Rate unit);

// Each conversion is exact but for one rounding, and saturates at +-(2^31 - 1).

/// Counts of so many r/min, rounded towards 0: never faster than asked.
std::int32_t counts_of(Rate unit, std::int64_t pulses_per_revolution, int rpm);
/// r/min of so many counts, the nearest, half away from 0.
std::int32_t rpm_of(Rate unit, std::int64_t pulses_per_revolution, std::int64_t counts);
/// What a ramp is for, and so what its rounding must not do.
enum class RampUse : std::uint8_t {
  start,  ///< never harder than told: rounded down
  brake,  ///< never softer than told, by which the bounds of stops are: rounded up. Of a ramp for both, too
};
/// Counts of an acceleration between rest and `rpm` in `time` (at least 1 ms); at least 1, without which
/// nothing would move.
std::int32_t ramp_of(Rate unit, std::int64_t pulses_per_revolution, int rpm, Duration time, RampUse use);
/// How long such a ramp of so many counts (more than 0) takes between rest and `rpm`; a day at most.
Duration time_of_ramp(Rate unit, std::int64_t pulses_per_revolution, int rpm, std::int64_t counts);
/// r/min of one count, of pulses where a revolution has one.
double rpm_of_count(Rate unit);

/// The same limits whatever a revolution has: of units that are no pulses in r/min, rounded into the range.
std::int32_t fastest_rpm(Rate unit, std::int64_t counts);
/// The lowest from which rounding costs no more than a fifth of what was asked: a motion ends in the time
/// that is predicted for it.
std::int32_t slowest_rpm(Rate unit);
/// Of a unit of pulses: pulses per second, at most 10^12.
std::int64_t fastest_pulse_rate(Rate unit, std::int64_t counts);

/// Who says what a value counts.
enum class UnitSource : std::uint8_t {
  model,          ///< the manual of the model
  data_sheet,     ///< the values of unit objects in the file
  configuration,  ///< the key `velocity_unit` or `acceleration_unit`
};
enum class Ramps : std::uint8_t {
  times,  ///< ms from start speed to speed
  rates,
};
/// What the values of 6081h, 6099h, 606Ch, 60FFh (velocities), 6083h, 6084h and 609Ah (ramps) count.
struct Units {
  Rate velocity = revolutions_per_minute;
  Ramps ramps = Ramps::times;
  Rate acceleration = revolutions_per_minute;  ///< of ramps that are rates
  UnitSource velocity_source = UnitSource::model, acceleration_source = UnitSource::model;
};

}  // namespace axisd::cia402
