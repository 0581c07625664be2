#include "config/start_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

/// Beside the objects of the motion block: status word, control word and mode, and what confirms them.
constexpr int words_of_start = 8;

auto in_ms(Duration time) { return std::chrono::ceil<std::chrono::milliseconds>(time).count(); }

/// The state is read, and what is loaded is looked at once more, within the guard.
bool is_read_within_guard(const AxisSettings& axis, const DriveDescriptor& drive) {
  return std::ranges::any_of(axis.inputs, [&drive](const TerminalSettings& input) {
    const auto* function = find_function(drive.input_functions, input.function);
    return input.function == "motor_free" || (function != nullptr && function->starts_motion);
  });
}

/// Of what is loaded first: control word, status word, mode and motion, the proof of the block, the trigger.
constexpr int words_of_loaded = 6;

void look_at(const AxisSettings& axis, const DriveDescriptor& drive, Duration answer, bool in_group,
             std::vector<std::string>& lines) {
  const auto& set = drive.can_transactions;
  // The proof of the block is mostly one object of it.
  const int loaded = set.state_transfers + words_of_loaded;
  const int proven = is_read_within_guard(axis, drive) ? loaded : 1;
  const bool alone = proven * answer < axis.reboot_guard;
  if (alone && in_group && loaded * answer >= axis.reboot_guard)
    lines.push_back(
        fmt::format("axis {}: a start in a group is proven by up to {} SDO answers within reboot_guard ({} "
                    "ms), and takes {} ms "
                    "for that (sdo_answer): such moves may end as expired; raise reboot_guard up to what the "
                    "drive needs to "
                    "boot, or move the axis by itself",
                    axis.name, loaded, in_ms(axis.reboot_guard), in_ms(loaded * answer)));
  if (!alone)
    lines.push_back(fmt::format(
        "axis {}: a start is proven by {} SDO answer{} within reboot_guard ({} ms), and takes {} ms for that "
        "(sdo_answer): none would be sent; raise reboot_guard up to what the drive needs to boot",
        axis.name, proven, proven == 1 ? "" : "s", in_ms(axis.reboot_guard), in_ms(proven * answer)));
  // The block is found, written and read back.
  const int all = words_of_start + 3 * set.continuity_transfers;
  if (all * answer >= axis.start_within)
    lines.push_back(
        fmt::format("axis {}: a start takes up to {} SDO answers, {} ms (sdo_answer), and start_within is {} "
                    "ms: it may end "
                    "as expired; raise start_within",
                    axis.name, all, in_ms(all * answer), in_ms(axis.start_within)));
}

}  // namespace

std::vector<std::string> start_warnings(const Configuration& configuration) {
  std::vector<std::string> lines;
  for (const auto& entry : configuration.axes) {
    const auto& axis = entry.axis;
    const auto network = std::ranges::find(configuration.networks, axis.bus, &canopen::NetworkSettings::name);
    const auto* drive = descriptor_of(axis);
    if (network == configuration.networks.end() || drive == nullptr) continue;
    const bool in_group = std::ranges::any_of(configuration.groups, [&axis](const GroupSettings& group) {
      return std::ranges::find(group.axes, axis.name) != group.axes.end();
    });
    look_at(axis, *drive, network->sdo_answer, in_group, lines);
  }
  return lines;
}

}  // namespace axisd::config
