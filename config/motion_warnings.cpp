#include "config/motion_warnings.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "buses/seconds.hpp"
#include "config/quantity.hpp"
#include "devices/axis/planner.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

std::optional<double> range_of(const AxisSettings& axis) {
  const auto& limits = axis.limits;
  if (!limits.position_minimum || !limits.position_maximum) return std::nullopt;
  return *limits.position_maximum - *limits.position_minimum;
}

/// For people; below 1 with two digits.
std::string to_a_tenth(double value) {
  return value < 1 ? fmt::format("{:.2g}", value) : format_number(std::round(value * 10) / 10);
}

void look_at_ways(const AxisSettings& axis, std::vector<std::string>& lines) {
  const auto range = range_of(axis);
  if (!range) return;
  const auto way = [&axis](double value) {
    return fmt::format("{} {}", format_number(value), axis.scale.unit);
  };
  if (axis.jog_travel > *range)
    lines.push_back(
        fmt::format("axis {}: jog_travel {} is more than the range of limits.position, {}: nothing but a "
                    "limit switch ends a jog while the position is unknown; write a shorter one",
                    axis.name, way(axis.jog_travel), way(*range)));
  if (axis.homing && axis.homing->max_travel && *axis.homing->max_travel < *range)
    lines.push_back(fmt::format(
        "axis {}: homing ends after {} (max_travel), of a range of {}: it does not find home from everywhere",
        axis.name, way(*axis.homing->max_travel), way(*range)));
}

/// A drive that brakes with a ramp of its own, for longer than it is told.
void look_at_braking(const AxisSettings& axis, const DriveDescriptor& drive,
                     std::vector<std::string>& lines) {
  const auto& capabilities = drive.capabilities;
  if (capabilities.fixed_deceleration == 0) return;
  const auto& limits = axis.limits;
  const Scale scale(axis.scale);
  const auto time = Planner(axis, drive, scale).braking_time(limits.velocity, Duration::zero());
  if (time <= limits.acceleration_time) return;
  const auto ramp = capabilities.acceleration_count.rpm > 0
                        ? fmt::format("with {} of its acceleration units", capabilities.fixed_deceleration)
                        : fmt::format("for {} ms", capabilities.fixed_deceleration);
  lines.push_back(fmt::format(
      "axis {}: object 6084h is only read: the drive brakes {}, whatever it is told: from limits.velocity {} "
      "{}/s that takes {} s and {} {}{}",
      axis.name, ramp, format_number(limits.velocity), axis.scale.unit, to_a_tenth(in_seconds(time)),
      to_a_tenth(limits.velocity * in_seconds(time) / 2), axis.scale.unit,
      capabilities.quick_stop_ramp == QuickStopRamp::of_stop ? "; QuickStop is no harder" : ""));
}

}  // namespace

std::vector<std::string> motion_warnings(const Configuration& configuration) {
  std::vector<std::string> lines;
  for (const auto& entry : configuration.axes) {
    look_at_ways(entry.axis, lines);
    if (const auto* drive = descriptor_of(entry.axis)) look_at_braking(entry.axis, *drive, lines);
  }
  return lines;
}

}  // namespace axisd::config
