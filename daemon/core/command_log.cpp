#include "daemon/core/command_log.hpp"

#include <ranges>
#include <utility>

namespace axisd::core {

void CommandLog::tell(const Command& now) {
  tell_(now.axis, CommandChange{.command = std::make_shared<const Command>(now)});
}

void CommandLog::add(const CommandPtr& command) {
  commands_.erase(lane_.add(command->value().client, ++last_));
  commands_.emplace_hint(commands_.end(), last_, command);
  tell(command->value());
  follow(command);
}

void CommandLog::follow(const CommandPtr& command) {
  if (command->has_ended()) return tell(command->value());
  command->observe(alive_, [this](const Command& now) {
    if (ended(now.state)) tell(now);
  });
}

std::vector<Command> CommandLog::newest(const std::string& axis, std::size_t most) const {
  std::vector<Command> found;
  for (const auto& [sequence, command] : std::views::reverse(commands_)) {
    if (found.size() == most) break;
    if (axis.empty() || command->value().axis == axis) found.push_back(command->value());
  }
  return found;
}

}  // namespace axisd::core
