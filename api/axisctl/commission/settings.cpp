#include "api/axisctl/commission/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "config/configuration.hpp"
#include "config/models.hpp"

namespace axisd::axisctl::commission {
namespace {

double in_seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

const char* method_name(HomingMethod method) {
  switch (method) {
    case HomingMethod::home_positive:
      return "home_positive";
    case HomingMethod::home_negative:
      return "home_negative";
    case HomingMethod::positive_limit:
      return "positive_limit";
    case HomingMethod::negative_limit:
      return "negative_limit";
  }
  return "";
}

Settings settings_of(const AxisSettings& from) {
  Settings to{
      .axis = from.name,
      .unit = from.scale.unit,
      .position_minimum = from.limits.position_minimum,
      .position_maximum = from.limits.position_maximum,
      .velocity = from.limits.velocity,
      .acceleration_time = in_seconds(from.limits.acceleration_time),
      .deceleration_time = in_seconds(from.limits.deceleration_time.value_or(from.limits.acceleration_time)),
      .jog_travel = from.jog_travel,
      .invert = from.scale.invert,
      .modulo = from.scale.modulo,
      .vertical = from.vertical,
      .homing_method = {},
      .homing_travel = {},
      .inputs = {}};
  if (from.homing) {
    to.homing_method = from.homing->number ? fmt::format("method {} of the drive", int{*from.homing->number})
                                           : method_name(from.homing->method);
    to.homing_velocity = from.homing->velocity;
    to.homing_travel = from.homing->max_travel;
  }
  to.may_start_in_one_frame = config::may_start_in_one_frame(from);
  const auto one_frame = from.model_settings.find("start_in_one_frame");
  to.starts_in_one_frame = to.may_start_in_one_frame && one_frame != from.model_settings.end() &&
                           one_frame->second == SettingValue(true);
  for (const auto& terminal : from.inputs) {
    Input input;
    input.set_terminal(terminal.terminal);
    input.set_function(terminal.function);
    input.set_active(terminal.active_low ? "low" : "high");
    to.inputs.push_back(std::move(input));
  }
  return to;
}

}  // namespace

SettingsResult settings_of(std::string_view yaml, const std::string& path, std::string_view axis) {
  const auto loaded = config::load_text(yaml, path);
  if (!loaded.configuration)
    return {.settings = {},
            .why_not = loaded.diagnostics.empty() ? path : config::to_string(loaded.diagnostics.front())};
  const auto& axes = loaded.configuration->axes;
  const auto found =
      std::ranges::find_if(axes, [&](const config::AxisEntry& entry) { return entry.axis.name == axis; });
  if (found == axes.end()) return {.settings = {}, .why_not = fmt::format("{}: no axis {}", path, axis)};
  return {.settings = settings_of(found->axis), .why_not = {}};
}

Settings with_braking(Settings settings, double published) {
  settings.deceleration_time = std::max(settings.deceleration_time, published);
  return settings;
}

}  // namespace axisd::axisctl::commission
