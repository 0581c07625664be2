#include "devices/cia402/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "devices/cia402/encoding.hpp"
#include "devices/setup_codes.hpp"

namespace axisd::cia402 {

namespace {

/// 6098h apart: its code is negotiated.
std::vector<DriveSetting> homing_objects(const Model& model, const DriveSetup& setup) {
  static constexpr std::pair<canopen::Object, std::string_view> keys[] = {
      {object::homing_speed, "velocity"},
      {object::homing_search_speed, "search_velocity"},
      {object::homing_acceleration, "acceleration_time"},
      {object::home_offset, "offset"}};
  std::vector<DriveSetting> all;
  for (const auto& [object, value] : encode(model, setup.pulses_per_revolution, *setup.homing)) {
    const auto* key = std::ranges::find(keys, object, &std::pair<canopen::Object, std::string_view>::first);
    // Compared before each homing.
    all.push_back({.address = object.key(),
                   .value = value,
                   .key = fmt::format("homing.{}", key->second),
                   .watched = false});
  }
  return all;
}

std::optional<std::uint32_t> place(const std::optional<canopen::Object>& object) {
  return object ? std::optional(object->key()) : std::nullopt;
}

SettingPlaces places_of(const Model& model) {
  const auto& objects = model.objects;
  SettingPlaces places{.input_levels = place(objects.input_levels),
                       .first_input_function = place(objects.first_input_function),
                       .output_levels = place(objects.output_levels),
                       .first_output_function = place(objects.first_output_function)};
  if (const auto& identification = model.descriptor->can_identification) {
    places.microstep = place(objects.microstep);
    places.microstep_codes = identification->microstep_codes;
  }
  return places;
}

}  // namespace

Result<std::vector<DriveSetting>> required_objects(const Model& model, const DriveSetup& setup) {
  auto all = required_settings(*model.descriptor, setup, places_of(model),
                               setup.homing ? homing_objects(model, setup) : std::vector<DriveSetting>());
  if (!all) return all;
  for (auto& setting : *all) {
    const auto* parameter = find_parameter(model.descriptor->parameters, setting.address);
    setting.obeys_switch = parameter != nullptr && parameter->access == Access::rw_saved;
    setting.saved = setting.saved && setting.obeys_switch;
  }
  return all;
}

ActiveLow active_low(const Model& model, const DriveSetup& setup) {
  const auto states = setup.model_settings.find(std::string(terminal_states_key));
  if (states == setup.model_settings.end() || states->second != SettingValue(std::string("level"))) return {};
  const auto& descriptor = *model.descriptor;
  const auto inputs = assign_terminals(setup.inputs, descriptor.inputs, descriptor.input_functions);
  const auto outputs = assign_terminals(setup.outputs, descriptor.outputs, descriptor.output_functions);
  return {.inputs = inputs ? inputs->levels : 0, .outputs = outputs ? outputs->levels : 0};
}

}  // namespace axisd::cia402
