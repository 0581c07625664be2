#include "devices/cia402/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "devices/cia402/encoding.hpp"
#include "devices/setup_codes.hpp"

namespace axisd::cia402 {

namespace {

/// Collects settings in the order of writing, each in the size that the model's dictionary gives it.
class Collector {
 public:
  Collector(const Model& model, const DriveSetup& setup) : model_(&model), setup_(&setup) {}

  void add_levels(const TerminalAssignment& inputs, const TerminalAssignment& outputs);
  void add_inputs(const TerminalAssignment& inputs, bool limits_and_stops);
  void add_outputs(const TerminalAssignment& outputs);
  Result<void> add_microstep();
  void add_model_settings();
  void add_homing();
  [[nodiscard]] std::vector<ObjectSetting> take() { return std::move(all_); }

 private:
  ObjectSetting& add(canopen::Object object, std::int64_t value, std::string key, bool saved);
  static canopen::Object terminal(canopen::Object first, std::size_t number) {
    return {first.index, static_cast<std::uint8_t>(first.sub + number)};
  }

  const Model* model_;
  const DriveSetup* setup_;
  std::vector<ObjectSetting> all_;
};

ObjectSetting& Collector::add(canopen::Object object, std::int64_t value, std::string key, bool saved) {
  const auto* parameter = find_parameter(model_->descriptor->parameters, object.key());
  return all_.emplace_back(
      ObjectSetting{.address = object.key(),
                    .value = value,
                    .bytes = type_of(*model_, object).bytes,
                    .key = std::move(key),
                    .saved = saved && parameter != nullptr && parameter->access == Access::rw_saved});
}

void Collector::add_levels(const TerminalAssignment& inputs, const TerminalAssignment& outputs) {
  if (const auto levels = model_->objects.input_levels)
    add(*levels, inputs.levels, "inputs", setup_->persist.terminals);
  if (const auto levels = model_->objects.output_levels; levels && outputs.named != 0)
    add(*levels, outputs.levels, "outputs", setup_->persist.terminals).mask = outputs.named;
}

void Collector::add_inputs(const TerminalAssignment& inputs, bool limits_and_stops) {
  const auto first = model_->objects.first_input_function;
  if (!first) return;
  for (std::size_t i = 0; i < inputs.functions.size(); ++i) {
    const auto* function = inputs.functions[i];
    if (is_limit_or_stop(function) != limits_and_stops) continue;
    auto& setting =
        add(terminal(*first, i), function == nullptr ? 0 : function->code,
            fmt::format("inputs.{}", model_->descriptor->inputs[i].name), setup_->persist.terminals);
    setting.starts_motion = function != nullptr && function->starts_motion;
    setting.input_bits = 1U << i;
  }
}

void Collector::add_outputs(const TerminalAssignment& outputs) {
  const auto first = model_->objects.first_output_function;
  if (!first) return;
  for (std::size_t i = 0; i < outputs.functions.size(); ++i)
    if (const auto* function = outputs.functions[i])
      add(terminal(*first, i), function->code, fmt::format("outputs.{}", model_->descriptor->outputs[i].name),
          setup_->persist.terminals);
}

Result<void> Collector::add_microstep() {
  if (!model_->objects.microstep || !model_->descriptor->can_identification) return {};
  const auto codes = model_->descriptor->can_identification->microstep_codes;
  const auto code = std::ranges::find(codes, setup_->pulses_per_revolution);
  if (code == codes.end())
    return fail(Reason::misconfigured, fmt::format("the drive has no microstep setting of {} pulses/rev",
                                                   setup_->pulses_per_revolution));
  add(*model_->objects.microstep, code - codes.begin(), "scale.microstep", setup_->persist.drive);
  return {};
}

void Collector::add_model_settings() {
  for (const auto& spec : model_->descriptor->settings) {
    const auto found = setup_->model_settings.find(std::string(spec.key));
    const auto code = found == setup_->model_settings.end() ? std::nullopt : code_of(spec, found->second);
    if (!code) continue;
    add(canopen::Object::of(*spec.object), *code, fmt::format("drive.{}", spec.key), setup_->persist.drive);
  }
}

void Collector::add_homing() {
  static constexpr std::pair<canopen::Object, std::string_view> keys[] = {
      {object::homing_speed, "velocity"},
      {object::homing_search_speed, "search_velocity"},
      {object::homing_acceleration, "acceleration_time"},
      {object::home_offset, "offset"}};
  for (const auto& [object, value] : encode(*model_, setup_->pulses_per_revolution, *setup_->homing)) {
    const auto* key = std::ranges::find(keys, object, &std::pair<canopen::Object, std::string_view>::first);
    add(object, value, fmt::format("homing.{}", key->second), setup_->persist.homing);
  }
}

}  // namespace

Result<std::vector<ObjectSetting>> required_objects(const Model& model, const DriveSetup& setup) {
  const auto& descriptor = *model.descriptor;
  const auto inputs = assign_terminals(setup.inputs, descriptor.inputs, descriptor.input_functions);
  if (!inputs) return fail(inputs.error());
  const auto outputs = assign_terminals(setup.outputs, descriptor.outputs, descriptor.output_functions);
  if (!outputs) return fail(outputs.error());
  Collector all(model, setup);
  all.add_levels(*inputs, *outputs);
  all.add_inputs(*inputs, true);
  if (const auto microstep = all.add_microstep(); !microstep) return fail(microstep.error());
  all.add_model_settings();
  if (setup.homing) all.add_homing();
  all.add_outputs(*outputs);
  all.add_inputs(*inputs, false);
  return all.take();
}

ActiveLow active_low(const Model& model, const DriveSetup& setup) {
  const auto states = setup.model_settings.find(std::string(terminal_states_key));
  if (states == setup.model_settings.end() || states->second != SettingValue(std::string("level"))) return {};
  const auto& descriptor = *model.descriptor;
  const auto inputs = assign_terminals(setup.inputs, descriptor.inputs, descriptor.input_functions);
  const auto outputs = assign_terminals(setup.outputs, descriptor.outputs, descriptor.output_functions);
  return {.inputs = inputs ? inputs->levels : 0, .outputs = outputs ? outputs->levels : 0};
}

SetupObjects::SetupObjects(const Model& model, const DriveSetup& setup)
    : active_low(cia402::active_low(model, setup)) {
  auto all = required_objects(model, setup);
  if (all)
    required = std::move(*all);
  else
    error = all.error();
}

}  // namespace axisd::cia402
