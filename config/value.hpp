// One value of the file, checked against its key's definition.
#pragma once

#include <expected>
#include <string>
#include <string_view>

#include "config/document.hpp"
#include "config/schema.hpp"

namespace axisd::config {

struct ValueError {
  Mark mark;
  std::string message, suggestion;
};

/// `unit`: the axis's unit; empty if it is not known (then any unit is accepted). Not for kinds with
/// children.
std::expected<Value, ValueError> parse_value(const KeySpec& spec, const Node& node, std::string_view unit);

/// "a list", "a section" ...: what stands there instead of what is wanted.
std::string_view kind_name(const Node& node);
/// Whether `text` as a whole matches.
bool matches(std::string_view text, std::string_view pattern);

}  // namespace axisd::config
