#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace axisd {

/// How one axis turns user units into motor pulses, as the YAML says it; all values are exact ratios.
struct ScaleSettings {
  std::int64_t pulses_per_revolution = 0;  ///< microstep setting of the drive (motor revolution)
  std::int64_t gear_motor = 1;             ///< gear: motor revolutions ...
  std::int64_t gear_output = 1;            ///< ... per output revolutions
  /// Travel in user units per output revolution, as a decimal that was written in the YAML: numerator /
  /// denominator.
  std::int64_t travel_numerator = 1, travel_denominator = 1;
  bool invert = false;           ///< positive axis direction = negative drive direction (M18)
  std::optional<double> modulo;  ///< rotary axes: user units per turn (360)
  std::string unit = "rev";      ///< mm, deg, rev ...
};

/// Conversions in the axis's own direction; invert is applied here and nowhere else. Pure, never undefined:
/// what does not fit saturates. Sums of distances belong into exact_scale.hpp.
class Scale {
 public:
  /// Precondition: valid(settings); else throws std::invalid_argument.
  explicit Scale(ScaleSettings settings);
  /// All ratios are positive, and pulses per unit is a ratio of two 63-bit numbers.
  [[nodiscard]] static bool valid(const ScaleSettings& settings);

  [[nodiscard]] const ScaleSettings& settings() const { return settings_; }
  /// Signed pulses (drive direction) per user unit as a ratio.
  [[nodiscard]] double pulses_per_unit() const;
  /// The same exactly, in lowest terms: numerator (signed, not 0) / denominator (> 0).
  [[nodiscard]] std::int64_t numerator() const { return numerator_; }
  [[nodiscard]] std::int64_t denominator() const { return denominator_; }
  /// Position in user units of a (drive direction) pulse count.
  [[nodiscard]] double to_units(std::int64_t pulses) const;
  /// Nearest pulse count; exact ratio, rounded once, half away from zero. Saturates at the ends of the type;
  /// NaN gives 0: use checked_pulses() to refuse both.
  [[nodiscard]] std::int64_t to_pulses(double units) const;
  /// As to_pulses(), but nullopt for NaN, infinity and whatever does not fit.
  [[nodiscard]] std::optional<std::int64_t> checked_pulses(double units) const;
  /// User units per second (axis direction) of a motor speed in r/min, and back (unrounded).
  [[nodiscard]] double velocity_to_units(double rpm) const;
  [[nodiscard]] double velocity_to_rpm(double units_per_second) const;

 private:
  ScaleSettings settings_;
  std::int64_t numerator_ = 1, denominator_ = 1;
};

}  // namespace axisd
