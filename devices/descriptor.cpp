#include "devices/descriptor.hpp"

#include <algorithm>

#include "devices/axis/settings.hpp"

namespace axisd {

const DriveDescriptor* find_drive_model(std::string_view model) {
  for (const auto* descriptor : drive_models())
    if (descriptor->model == model) return descriptor;
  return nullptr;
}

const DriveDescriptor* descriptor_of(const AxisSettings& axis) {
  return axis.own_descriptor ? axis.own_descriptor.get() : find_drive_model(axis.model);
}

const AlarmSpec* find_alarm(const DriveDescriptor& drive, std::uint16_t code) {
  constexpr unsigned all_digits = 0xFFFF, digit_bits = 4;
  for (unsigned digits = all_digits;; digits = (digits << digit_bits) & all_digits) {
    for (const auto rows : {drive.alarms, drive.other_alarms})
      if (const auto found = std::ranges::find(rows, code & digits, &AlarmSpec::code); found != rows.end())
        return &*found;
    if (digits == 0 || drive.other_alarms.empty()) return nullptr;
  }
}

const ParameterSpec* find_parameter(std::span<const ParameterSpec> catalogue, std::uint32_t address) {
  const auto found = std::ranges::lower_bound(catalogue, address, {}, &ParameterSpec::address);
  return found == catalogue.end() || found->address != address ? nullptr : &*found;
}

const TerminalFunctionSpec* find_function(std::span<const TerminalFunctionSpec> functions,
                                          std::string_view name) {
  for (const auto& function : functions)
    if (function.name == name) return &function;
  return nullptr;
}

}  // namespace axisd
