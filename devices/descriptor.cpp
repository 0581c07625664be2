#include "devices/descriptor.hpp"

#include <algorithm>

namespace axisd {

const DriveDescriptor* find_drive_model(std::string_view model) {
  for (const auto* descriptor : drive_models())
    if (descriptor->model == model) return descriptor;
  return nullptr;
}

const DriveDescriptor* descriptor_of(const AxisSettings& axis) {
  return axis.own_descriptor ? axis.own_descriptor.get() : find_drive_model(axis.model);
}

namespace {

/// Hexadecimal digits at the end of a row's code that are 0 stand for any (CiA 301, CiA 402).
bool is_of_class(std::uint16_t code, const AlarmSpec& row) {
  unsigned digits = 0xFFFF;
  while ((row.code & digits & ~(digits << 4U)) == 0 && (digits & 0xFFFFU) != 0) digits <<= 4U;
  return ((code ^ row.code) & digits & 0xFFFFU) == 0;
}

}  // namespace

/// The table of other alarms ends with the row that holds for all.
const AlarmSpec* find_alarm(const DriveDescriptor& drive, std::uint16_t code) {
  const auto found = std::ranges::find(drive.alarms, code, &AlarmSpec::code);
  if (found != drive.alarms.end()) return &*found;
  const auto* row = drive.other_alarms;
  while (row != nullptr && !is_of_class(code, *row)) ++row;
  return row;
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
