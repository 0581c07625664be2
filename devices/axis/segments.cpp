#include "devices/axis/segments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace axisd {

namespace {

Error out_of_range(int number, const std::string& what, double minimum, double maximum, std::string unit) {
  return {.reason = Reason::out_of_range,
          .message = fmt::format("segment {}: {}", number, what),
          .remedy = fmt::format("permitted: {} to {} {}", minimum, maximum, unit),
          .permitted = Range{.minimum = minimum, .maximum = maximum, .unit = std::move(unit)}};
}

/// Axis position at the drive's zero.
double zero_of(const AxisSettings& axis) { return axis.homing ? axis.homing->position : 0; }

/// Converts rows of one axis, one after the other.
class Rows {
 public:
  Rows(const AxisSettings& axis, const Scale& scale, const Capabilities& capabilities)
      : axis_(&axis), scale_(&scale), capabilities_(&capabilities) {
    table_.rows.resize(static_cast<std::size_t>(capabilities.maximum_segments));
  }

  Result<void> add(const PositionSegment& segment, bool absolute);
  Result<void> add(const VelocitySegment& segment);
  [[nodiscard]] const DriveSegments& table() const { return table_; }

 private:
  Result<DriveSegments::Row*> row(int number, std::set<int>& taken);
  [[nodiscard]] Result<int> speed(int number, double velocity) const;
  Result<void> set_time(int number, DriveSegments::Row& row, Duration time);

  const AxisSettings* axis_;
  const Scale* scale_;
  const Capabilities* capabilities_;
  DriveSegments table_;
  std::set<int> positions_, velocities_, timed_;
};

Result<DriveSegments::Row*> Rows::row(int number, std::set<int>& taken) {
  const int most = capabilities_->maximum_segments;
  if (number < 1 || number > most)
    return fail(out_of_range(number, "the drive's inputs cannot select it", 1, most, ""));
  if (!taken.insert(number).second)
    return fail(Reason::invalid_argument, fmt::format("segment {} is given twice", number),
                "give each number once");
  return &table_.rows.at(static_cast<std::size_t>(number - 1));
}

Result<int> Rows::speed(int number, double velocity) const {
  const auto pulses = static_cast<double>(axis_->scale.pulses_per_revolution);
  const auto most = std::min<double>(capabilities_->maximum_rpm,
                                     static_cast<double>(capabilities_->maximum_pulse_rate_hz) * 60 / pulses);
  const auto fastest =
      std::min(std::abs(scale_->velocity_to_units(std::floor(most))), axis_->limits.velocity);
  const auto slowest = std::abs(scale_->velocity_to_units(capabilities_->minimum_rpm));
  const auto rpm = std::round(std::abs(scale_->velocity_to_rpm(velocity)));
  const bool fits = velocity > 0 && velocity <= fastest * (1 + 1e-9) && rpm >= capabilities_->minimum_rpm;
  if (!fits)
    return fail(out_of_range(number, fmt::format("velocity {} is not possible", velocity), slowest, fastest,
                             axis_->scale.unit + "/s"));
  return static_cast<int>(rpm);
}

Result<void> Rows::set_time(int number, DriveSegments::Row& row, Duration time) {
  const auto least = std::chrono::milliseconds(capabilities_->minimum_segment_time_ms);
  const auto most = std::chrono::milliseconds(capabilities_->maximum_time_ms);
  if (time < least || time > most)
    return fail(out_of_range(number, "acceleration_time is not possible", static_cast<double>(least.count()),
                             static_cast<double>(most.count()), "ms"));
  const auto rounded = std::chrono::round<std::chrono::milliseconds>(time);
  // A row has one time for both tables.
  if (!timed_.insert(number).second && row.acceleration_time != rounded)
    return fail(Reason::invalid_argument,
                fmt::format("segment {}: position and velocity segment share one acceleration_time", number),
                "give both the same");
  row.acceleration_time = rounded;
  return {};
}

Result<void> Rows::add(const PositionSegment& segment, bool absolute) {
  const auto target = row(segment.number, positions_);
  if (!target) return fail(target.error());
  const auto rpm = speed(segment.number, segment.velocity);
  if (!rpm) return fail(rpm.error());
  const auto pulses = scale_->checked_pulses(segment.target - (absolute ? zero_of(*axis_) : 0));
  using Limits = std::numeric_limits<std::int32_t>;
  if (!pulses || *pulses < Limits::min() || *pulses > Limits::max()) {
    const auto most = std::abs(scale_->to_units(Limits::max()));
    return fail(out_of_range(segment.number, "target is not representable", -most, most, axis_->scale.unit));
  }
  const auto& limits = axis_->limits;
  if (absolute && limits.position_minimum &&
      (segment.target < *limits.position_minimum || segment.target > *limits.position_maximum)) {
    auto error = out_of_range(segment.number, "target is beyond the software limits",
                              *limits.position_minimum, *limits.position_maximum, axis_->scale.unit);
    error.reason = Reason::soft_limit;
    return fail(std::move(error));
  }
  (*target)->pulses = static_cast<std::int32_t>(*pulses);
  (*target)->velocity_rpm = *rpm;
  return set_time(segment.number, **target, segment.acceleration_time);
}

Result<void> Rows::add(const VelocitySegment& segment) {
  const auto target = row(segment.number, velocities_);
  if (!target) return fail(target.error());
  const auto rpm = speed(segment.number, segment.velocity);
  if (!rpm) return fail(rpm.error());
  (*target)->pv_velocity_rpm = *rpm;
  return set_time(segment.number, **target, segment.acceleration_time);
}

}  // namespace

Result<DriveSegments> to_drive(const SegmentSettings& segments, const AxisSettings& axis, const Scale& scale,
                               const DriveDescriptor& descriptor) {
  if (segments.absolute && axis.scale.modulo)
    return fail(Reason::not_supported,
                "absolute segments do not fit an axis that wraps: its counter is set to zero",
                "use relative segments, or leave scale.modulo out");
  if (segments.absolute && axis.homing && axis.homing->offset != 0)
    return fail(
        Reason::not_supported,
        "absolute segments and homing.offset: whether the drive counts from the switch or from beyond the "
        "offset is not said in its manual",
        "use homing.position instead of homing.offset");
  Rows rows(axis, scale, descriptor.capabilities);
  for (const auto& segment : segments.positions)
    if (const auto added = rows.add(segment, segments.absolute); !added) return fail(added.error());
  for (const auto& segment : segments.velocities)
    if (const auto added = rows.add(segment); !added) return fail(added.error());
  auto table = rows.table();
  table.absolute = segments.absolute;
  return table;
}

SegmentSettings from_drive(const DriveSegments& segments, const AxisSettings& axis, const Scale& scale) {
  SegmentSettings settings{.absolute = segments.absolute};
  for (std::size_t i = 0; i < segments.rows.size(); ++i) {
    const auto& row = segments.rows.at(i);
    const int number = static_cast<int>(i) + 1;
    const auto velocity = [&](int rpm) { return std::abs(scale.velocity_to_units(rpm)); };
    if (row.velocity_rpm != 0)
      settings.positions.push_back(
          {.number = number,
           .target = scale.to_units(row.pulses) + (segments.absolute ? zero_of(axis) : 0),
           .velocity = velocity(row.velocity_rpm),
           .acceleration_time = row.acceleration_time});
    if (row.pv_velocity_rpm != 0)
      settings.velocities.push_back({.number = number,
                                     .velocity = velocity(row.pv_velocity_rpm),
                                     .acceleration_time = row.acceleration_time});
  }
  return settings;
}

}  // namespace axisd
