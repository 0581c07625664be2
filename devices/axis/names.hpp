#pragma once

#include <optional>
#include <string_view>

#include "devices/axis/command.hpp"

namespace axisd {

/// The kind that to_string() names so; nothing: there is none.
std::optional<CommandKind> find_command_kind(std::string_view name);

}  // namespace axisd
