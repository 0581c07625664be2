#include "devices/drive_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/setup_codes.hpp"

namespace axisd {

namespace {

/// Collects settings in the order of writing.
class Collector {
 public:
  Collector(const DriveDescriptor& model, const DriveSetup& setup, const SettingPlaces& places)
      : model_(&model), setup_(&setup), places_(places) {}

  void add_levels(const TerminalAssignment& inputs, const TerminalAssignment& outputs);
  void add_inputs(const TerminalAssignment& inputs, bool limits_and_stops);
  void add_outputs(const TerminalAssignment& outputs);
  Result<void> add_microstep();
  void add_model_settings();
  void add_homing(std::vector<DriveSetting> homing);
  [[nodiscard]] std::vector<DriveSetting> take() { return std::move(all_); }

 private:
  DriveSetting& add(std::uint32_t address, std::int64_t value, std::string key, bool saved) {
    return all_.emplace_back(
        DriveSetting{.address = address, .value = value, .key = std::move(key), .saved = saved});
  }
  static std::uint32_t place(std::uint32_t first, std::size_t terminal) {
    return first + static_cast<std::uint32_t>(terminal);
  }

  const DriveDescriptor* model_;
  const DriveSetup* setup_;
  SettingPlaces places_;
  std::vector<DriveSetting> all_;
};

void Collector::add_levels(const TerminalAssignment& inputs, const TerminalAssignment& outputs) {
  if (places_.input_levels) add(*places_.input_levels, inputs.levels, "inputs", setup_->persist.terminals);
  if (places_.output_levels && outputs.named != 0)
    add(*places_.output_levels, outputs.levels, "outputs", setup_->persist.terminals).mask = outputs.named;
}

void Collector::add_inputs(const TerminalAssignment& inputs, bool limits_and_stops) {
  if (!places_.first_input_function) return;
  for (std::size_t i = 0; i < inputs.functions.size(); ++i) {
    const auto* function = inputs.functions[i];
    if (is_limit_or_stop(function) != limits_and_stops) continue;
    auto& setting = add(place(*places_.first_input_function, i), function == nullptr ? 0 : function->code,
                        fmt::format("inputs.{}", model_->inputs[i].name), setup_->persist.terminals);
    setting.starts_motion = function != nullptr && function->starts_motion;
    setting.input_bits = 1U << i;
  }
}

void Collector::add_outputs(const TerminalAssignment& outputs) {
  if (!places_.first_output_function) return;
  for (std::size_t i = 0; i < outputs.functions.size(); ++i)
    if (const auto* function = outputs.functions[i])
      add(place(*places_.first_output_function, i), function->code,
          fmt::format("outputs.{}", model_->outputs[i].name), setup_->persist.terminals);
}

Result<void> Collector::add_microstep() {
  if (!places_.microstep) return {};
  const auto code = std::ranges::find(places_.microstep_codes, setup_->pulses_per_revolution);
  if (code == places_.microstep_codes.end())
    return fail(Reason::misconfigured, fmt::format("the drive has no microstep setting of {} pulses/rev",
                                                   setup_->pulses_per_revolution));
  add(*places_.microstep, code - places_.microstep_codes.begin(), "scale.microstep", setup_->persist.drive);
  return {};
}

/// What the model's descriptor ties to a register or object: a choice's index, a number, or 0 and 1.
void Collector::add_model_settings() {
  for (const auto& spec : model_->settings) {
    const auto found = setup_->model_settings.find(std::string(spec.key));
    if (found == setup_->model_settings.end()) continue;
    if (const auto code = code_of(spec, found->second))
      add(*spec.object, *code, fmt::format("drive.{}", spec.key), setup_->persist.drive);
  }
}

void Collector::add_homing(std::vector<DriveSetting> homing) {
  for (auto& setting : homing) {
    setting.saved = setup_->persist.homing;
    all_.push_back(std::move(setting));
  }
}

}  // namespace

bool is_input_function(const DriveSetting& setting) { return setting.key.starts_with("inputs."); }

std::vector<std::uint32_t> addresses_of(std::span<const DriveSetting> settings) {
  std::vector<std::uint32_t> addresses;
  addresses.reserve(settings.size());
  for (const auto& setting : settings) addresses.push_back(setting.address);
  return addresses;
}

Result<std::vector<DriveSetting>> required_settings(const DriveDescriptor& model, const DriveSetup& setup,
                                                    const SettingPlaces& places,
                                                    std::vector<DriveSetting> homing) {
  const auto inputs = assign_terminals(setup.inputs, model.inputs, model.input_functions);
  if (!inputs) return fail(inputs.error());
  const auto outputs = assign_terminals(setup.outputs, model.outputs, model.output_functions);
  if (!outputs) return fail(outputs.error());
  Collector all(model, setup, places);
  all.add_levels(*inputs, *outputs);
  all.add_inputs(*inputs, true);
  if (const auto microstep = all.add_microstep(); !microstep) return fail(microstep.error());
  all.add_model_settings();
  all.add_homing(std::move(homing));
  all.add_outputs(*outputs);
  all.add_inputs(*inputs, false);
  return all.take();
}

}  // namespace axisd
