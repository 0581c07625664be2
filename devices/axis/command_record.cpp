#include "devices/axis/command_record.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "buses/log_about.hpp"

namespace axisd {

void CommandRecord::activate() {
  if (command_.state != CommandState::accepted) return;
  command_.state = CommandState::active;
  command_.started_at = clock_->wall(clock_->now());
  tell();
}

void CommandRecord::end(CommandState state, std::optional<Error> cause) {
  if (has_ended()) return;
  // What has begun was sent, whoever ended it.
  if (command_.state == CommandState::active && cause && cause->outcome == Outcome::not_sent)
    cause->outcome = Outcome::unknown;
  command_.state = state;
  command_.cause = std::move(cause);
  ended_when_ = clock_->now();
  command_.ended_at = clock_->wall(ended_when_);
  // Whoever sent it may not have waited for its end.
  if (state == CommandState::error || state == CommandState::unknown)
    log_about(
        spdlog::level::warn, LogKind::command_failed,
        {.axis = command_.axis, .client = command_.client, .command = command_.id},
        fmt::format("{}: {} ended as {} ({}){}", command_.axis, to_string(command_.kind), to_string(state),
                    command_.id, command_.cause ? ": " + to_string(*command_.cause) : ""));
  tell();
  observers_.clear();
}

void CommandRecord::observe(std::weak_ptr<void> alive, Observer observer) {
  if (!has_ended()) observers_.emplace_back(std::move(alive), std::move(observer));
}

void CommandRecord::tell() {
  std::erase_if(observers_, [](const auto& entry) { return entry.first.expired(); });
  // Observers may add others while they run.
  const auto current = observers_;
  for (const auto& [alive, observer] : current)
    if (!alive.expired()) observer(command_);
}

}  // namespace axisd
