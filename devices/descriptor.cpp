#include "devices/descriptor.hpp"

namespace axisd {

const DriveDescriptor* find_drive_model(std::string_view model) {
  for (const auto* descriptor : drive_models())
    if (descriptor->model == model) return descriptor;
  return nullptr;
}

const TerminalFunctionSpec* find_function(std::span<const TerminalFunctionSpec> functions,
                                          std::string_view name) {
  for (const auto& function : functions)
    if (function.name == name) return &function;
  return nullptr;
}

}  // namespace axisd
