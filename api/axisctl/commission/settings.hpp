// What the configuration says about an axis, as far as a commissioning needs it. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/axisctl/commission/record.pb.h"

namespace axisd::axisctl::commission {

/// Positions and distances in user units, times in s.
struct Settings {
  std::string axis;
  std::string unit;
  std::optional<double> position_minimum, position_maximum;  ///< soft limits: both or none
  double velocity = 0;                                       ///< highest, per second
  double acceleration_time = 0, deceleration_time = 0;
  double jog_travel = 0;  ///< longest relative move while the position is unknown; 0: none is permitted then
  bool invert = false;
  std::optional<double> modulo;  ///< positions of a rotary axis begin anew here
  bool vertical = false;         ///< `load: vertical`
  std::string homing_method;     ///< empty: none is configured
  double homing_velocity = 0;
  std::optional<double> homing_travel;  ///< at most
  bool may_start_in_one_frame = false;  ///< drive.start_in_one_frame can be true
  bool starts_in_one_frame = false;     ///< it is
  std::vector<Input> inputs;            ///< those that have a function, in the order of the file
};

struct SettingsResult {
  std::optional<Settings> settings;
  std::string why_not;  ///< one line, if there are none
};

/// Of the served file's text. A configuration that names files of the daemon's computer may not be readable
/// elsewhere. `path` leads error texts.
SettingsResult settings_of(std::string_view yaml, const std::string& path, std::string_view axis);

/// With what the daemon publishes of a stop from the highest velocity, s: a drive may brake for longer than
/// it is told.
Settings with_braking(Settings settings, double published);

}  // namespace axisd::axisctl::commission
