// Lines of the log about one axis.
#pragma once

#include <string_view>

#include "buses/log_about.hpp"
#include "devices/axis/settings.hpp"

namespace axisd {

/// log_about() with the axis, its bus and its node. `command`: the id of the command that it concerns.
inline void log_about_axis(spdlog::level::level_enum level, LogKind kind, const AxisSettings& axis,
                           std::string_view text, std::string_view command = {}) {
  log_about(level, kind, {.bus = axis.bus, .axis = axis.name, .command = command, .node = axis.node}, text);
}

}  // namespace axisd
