#include "config/models.hpp"

#include <algorithm>

#include "devices/descriptor.hpp"

namespace axisd::config {

bool is_described_by_file(std::string_view model) {
  const auto* found = find_drive_model(model);
  return found != nullptr && found->specialise != nullptr;
}

bool may_start_in_one_frame(const AxisSettings& axis) {
  const auto* model = find_drive_model(axis.model);
  if (model == nullptr ||
      std::ranges::find(model->settings, "start_in_one_frame", &SettingSpec::key) == model->settings.end())
    return false;
  return std::ranges::none_of(axis.inputs, [model](const TerminalSettings& input) {
    const auto* function = find_function(model->input_functions, input.function);
    return input.function == "motor_free" || (function != nullptr && function->starts_motion);
  });
}

}  // namespace axisd::config
