#include "devices/kept_state.hpp"

#include <fmt/format.h>

namespace axisd {
namespace {

std::string_view text_of(KeptFault fault) {
  switch (fault) {
    case KeptFault::missing:
      return "is missing";
    case KeptFault::rolled_back:
      return "was rolled back";
    case KeptFault::damaged:
      return "is damaged";
    case KeptFault::not_regular:
      return "is no regular file";
    case KeptFault::swapped:
      return "holds what belongs into another file";
    case KeptFault::foreign:
      return "does not belong to the other files";
  }
  return "is wrong";
}

}  // namespace

std::string_view name_of(KeptFile file) {
  switch (file) {
    case KeptFile::state:
      return "state.v1";
    case KeptFile::previous:
      return "state.v1.previous";
    case KeptFile::journal:
      return "journal.v1";
  }
  return "a file";
}

std::string to_string(const Conviction& conviction) {
  const auto* const counted = conviction.file == KeptFile::journal ? "line" : "generation";
  auto text = fmt::format("{} {}", name_of(conviction.file), text_of(conviction.fault));
  if (conviction.found != 0 && conviction.expected > conviction.found)
    text += fmt::format(": it has {0} {1}, but there was {0} {2}", counted, conviction.found,
                        conviction.expected);
  else if (conviction.found == 0 && conviction.expected != 0)
    text += fmt::format(": there was {} {}", counted, conviction.expected);
  if (!conviction.detail.empty()) text += fmt::format(" ({})", conviction.detail);
  return text;
}

std::string to_string(std::span<const Conviction> convictions) {
  std::string text;
  for (const auto& conviction : convictions) text += (text.empty() ? "" : "; ") + to_string(conviction);
  return text;
}

Error state_unaccepted(std::span<const Conviction> convictions) {
  return {.reason = Reason::state_unaccepted,
          .message = "what the daemon remembers is not certain: " + to_string(convictions),
          .remedy = "look at the machine, then accept it: axisctl state, axisctl state accept"};
}

}  // namespace axisd
