#include "devices/group/group.hpp"

#include <fmt/format.h>

#include <utility>

namespace axisd {

std::vector<std::string> names_of(const std::vector<GroupSettings>& groups) {
  std::vector<std::string> names;
  names.reserve(groups.size());
  for (const auto& group : groups) names.push_back(group.name);
  return names;
}

Error named(Error error, std::string_view axis) {
  const auto lead = fmt::format("{}: ", axis);
  if (!error.message.starts_with(lead))
    error.message = lead + (error.message.empty() ? std::string(to_string(error.reason)) : error.message);
  return error;
}

}  // namespace axisd
