#include "tests/unit/config/dump.hpp"

#include <fmt/format.h>

#include "config/fields.hpp"

namespace axisd::config {

std::string dump(const Configuration& configuration) {
  std::string text;
  for (const auto& section : sections(configuration))
    for (const auto& [key, value] : section.fields)
      text += fmt::format("{}.{}.{} = {}\n", section.section, section.name, key, value);
  return text;
}

}  // namespace axisd::config
