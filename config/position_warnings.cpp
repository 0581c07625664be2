#include "config/position_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "devices/descriptor.hpp"
#include "devices/released_position.hpp"

namespace axisd::config {

namespace {

/// A release shows in a message of its own on CAN, on RS-485 only to those who ask while it lasts.
bool may_be_missed(const AxisSettings& axis, const DriveDescriptor& drive) {
  const auto mode = axis.model_settings.find("loop_mode");
  const bool open = !drive.capabilities.closed_loop ||
                    (mode != axis.model_settings.end() && mode->second == SettingValue(std::string("open")));
  return drive.bus == BusKind::modbus_rtu && (open || !counts_released(drive, axis.model_settings));
}

}  // namespace

std::vector<std::string> position_warnings(const Configuration& configuration) {
  std::vector<std::string> lines;
  for (const auto& entry : configuration.axes) {
    const auto& axis = entry.axis;
    const auto free = std::ranges::find(axis.inputs, "motor_free", &TerminalSettings::function);
    const auto* drive = descriptor_of(axis);
    if (free == axis.inputs.end() || drive == nullptr || !may_be_missed(axis, *drive)) continue;
    lines.push_back(fmt::format(
        "axis {}: a release by {} (motor_free) that is shorter than its polling at rest ({} ms) may not be "
        "seen, and a shaft that is turned meanwhile is not counted; home the axis after such a "
        "release, or lower poll: {{ idle }}",
        axis.name, free->terminal, std::chrono::ceil<std::chrono::milliseconds>(axis.poll_idle).count()));
  }
  return lines;
}

}  // namespace axisd::config
