#include "config/file_warnings.hpp"

#include <set>

#include "config/text.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

std::vector<std::string> file_warnings(const Configuration& configuration) {
  constexpr std::size_t longest_line = 600;  // it quotes a path and a line of the file
  std::vector<std::string> lines;
  std::set<std::string_view> told;
  for (const auto& entry : configuration.axes) {
    if (entry.axis.own_descriptor == nullptr) continue;
    for (const auto& warning : entry.axis.own_descriptor->warnings)
      if (told.insert(warning).second) lines.push_back(printable(warning, longest_line));
  }
  return lines;
}

}  // namespace axisd::config
