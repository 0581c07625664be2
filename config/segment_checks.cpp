// The drive's table of segments (RTU manuals 7.3, 7.4): ranges, and whether terminals can select each.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "config/axis_checks.hpp"
#include "config/quantity.hpp"
#include "config/text.hpp"

namespace axisd::config {

namespace {

constexpr std::string_view positions = "segments.positions", velocities = "segments.velocities";
constexpr std::string_view pins[] = {"pin0", "pin1", "pin2", "pin3", "pin4"};

template <class Segment>
std::vector<int> numbers_of(const std::vector<Segment>& segments) {
  std::vector<int> numbers;
  numbers.reserve(segments.size());
  for (const auto& segment : segments) numbers.push_back(segment.number);
  return numbers;
}

}  // namespace

void AxisChecks::check_segments() {
  if (model_ != nullptr && model_->capabilities.maximum_segments == 0) {
    add("segments", fmt::format("model {} has no table of segments", axis_.model), "leave it out");
    return;
  }
  const auto& segments = *axis_.segments;
  if (!given(positions) && !given(velocities) && !given("segments.mode") && clean("segments"))
    add("segments", "'segments' is empty", "add positions or velocities, or leave it out");
  check_mode();
  share_times();
  if (model_ == nullptr) return;
  const auto& capabilities = model_->capabilities;
  const auto check_row = [&](std::string_view table, const auto& row) {
    const auto key = fmt::format("{}.{}", table, row.number);
    check_segment_number(key, row.number);
    check_time(key + ".acceleration_time", row.acceleration_time, capabilities.minimum_segment_time_ms);
    if (!scale_) return;
    check_speed(key + ".velocity", row.velocity, capabilities.minimum_rpm, maximum_rpm());
    check_below(key + ".velocity", row.velocity, "limits.velocity", axis_.limits.velocity);
  };
  for (const auto& row : segments.positions) check_row(positions, row);
  for (const auto& row : segments.velocities) check_row(velocities, row);
  check_segment_selection(positions, "pt_enable", numbers_of(segments.positions));
  check_segment_selection(velocities, "pv_enable", numbers_of(segments.velocities));
  if (scale_) check_targets();
}

void AxisChecks::check_mode() {
  if (!given("segments.mode") || !usable("segments.mode")) return;
  if (!given(positions) && clean("segments")) {
    add("segments.mode", "'mode' has no effect without positions", "leave it out");
  } else if (axis_.segments->absolute && axis_.scale.modulo) {
    // M19: whoever started a motion by terminal would not know.
    add("segments.mode", "'mode: absolute' and scale.modulo exclude each other",
        "the drive's counter of an endless axis starts again from zero: use mode: relative");
  }
}

void AxisChecks::check_segment_number(const std::string& key, int number) {
  const int last = model_->capabilities.maximum_segments;
  if (number <= last) return;
  add(key, fmt::format("the inputs of model {} cannot select segment {}", axis_.model, number),
      fmt::format("write a number between 1 and {}", last));
}

void AxisChecks::check_segment_selection(std::string_view table, std::string_view enable,
                                         const std::vector<int>& numbers) {
  if (numbers.empty() || !clean("inputs")) return;
  need_input(table, enable, fmt::format("'{}'", table));
  for (const int number : numbers) {
    // The pins form the number in binary, pin0 its lowest bit; 0 selects nothing (7.3.2, 7.4.2).
    std::vector<std::string_view> missing;
    for (std::size_t bit = 0; bit < std::size(pins); ++bit) {
      const bool needed = ((static_cast<unsigned>(number) >> bit) & 1U) != 0;
      if (needed && input_with(pins[bit]) == nullptr) missing.push_back(pins[bit]);
    }
    if (missing.empty()) continue;
    add(fmt::format("{}.{}", table, number),
        fmt::format("nothing can select segment {}: no input has function {}", number, alternatives(missing)),
        fmt::format("its number in binary is {:05b}, pin4 to pin0: assign these pins, or take another number",
                    number));
  }
}

void AxisChecks::check_targets() {
  const auto& segments = *axis_.segments;
  const auto& limits = axis_.limits;
  const bool limited = given("limits.position") && usable("limits.position");
  for (const auto& row : segments.positions) {
    const auto key = fmt::format("{}.{}.target", positions, row.number);
    if (!given(key) || !usable(key) || !usable("segments.mode")) continue;
    // The drive counts absolute targets from its own zero, which homing puts at homing.position.
    if (segments.absolute && axis_.homing) {
      check_distance(key, row.target - axis_.homing->position, " from homing.position");
    } else {
      check_distance(key, row.target);
    }
    const auto text = fmt::format("{} {}", format_number(row.target), axis_.scale.unit);
    if (segments.absolute) {
      if (limited && (row.target < *limits.position_minimum || row.target > *limits.position_maximum))
        add(key, fmt::format("target {} is outside of limits.position", text),
            fmt::format("write a position between {} and {}", format_number(*limits.position_minimum),
                        format_number(*limits.position_maximum)));
    } else if (scale_->checked_pulses(row.target) == 0) {
      add(key, fmt::format("a relative move by {} goes nowhere", text),
          "write a distance of at least one pulse, or mode: absolute");
    } else if (limited && std::abs(row.target) > *limits.position_maximum - *limits.position_minimum) {
      add(key, fmt::format("a relative move by {} always leaves limits.position", text),
          fmt::format("write at most {} either way",
                      format_number(*limits.position_maximum - *limits.position_minimum)));
    }
  }
}

void AxisChecks::share_times() {
  // Both tables have one acceleration time per number.
  for (auto& position : axis_.segments->positions) {
    const auto velocity =
        std::ranges::find(axis_.segments->velocities, position.number, &VelocitySegment::number);
    if (velocity == axis_.segments->velocities.end()) continue;
    const auto key = [&](std::string_view table) {
      return fmt::format("{}.{}.acceleration_time", table, position.number);
    };
    if (!usable(key(positions)) || !usable(key(velocities))) continue;
    if (!given(key(velocities))) {
      velocity->acceleration_time = position.acceleration_time;
    } else if (!given(key(positions))) {
      position.acceleration_time = velocity->acceleration_time;
    } else if (position.acceleration_time != velocity->acceleration_time) {
      add(key(velocities),
          fmt::format("acceleration_time {} differs from {} of the position segment {}",
                      format_duration(velocity->acceleration_time),
                      format_duration(position.acceleration_time), position.number),
          "the drive has one time per number: write it once, or use another number");
    }
  }
}

}  // namespace axisd::config
