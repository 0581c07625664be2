// How a group move stands.
#include <algorithm>

#include "devices/group/arrival.hpp"
#include "devices/group/group_run.hpp"

namespace axisd {

CommandState GroupRun::state() const {
  const auto any = [this](CommandState state) {
    return std::ranges::any_of(commands_, [&](const auto& c) { return c->value().state == state; });
  };
  // While one has not ended, the move has not, either.
  const bool over = std::ranges::all_of(commands_, [](const auto& command) { return command->has_ended(); });
  if (!over) return any(CommandState::accepted) ? CommandState::accepted : CommandState::active;
  for (const auto worst : {CommandState::unknown, CommandState::error, CommandState::aborted})
    if (any(worst)) return worst;
  return CommandState::done;
}

/// Members that end at once are seen to shortly after.
std::optional<Error> GroupRun::cause() const {
  if (cause_ || !ended(state())) return cause_;
  for (const auto& command : commands_)
    if (const auto& value = command->value(); value.cause) return named(*value.cause, value.axis);
  return std::nullopt;
}

GroupMove GroupRun::value() const {
  GroupMove move{.id = parts_.id,
                 .group = parts_.request.group,
                 .state = state(),
                 .cause = cause(),
                 .arrive_together = parts_.request.arrive_together};
  std::vector<Duration> predicted;
  std::vector<TimePoint> starts, arrivals;
  bool all_arrived = !members_.empty();
  for (const auto& member : members_) {
    predicted.push_back(member->predicted());
    if (member->started_at()) starts.push_back(*member->started_at());
    if (member->arrived_at()) arrivals.push_back(*member->arrived_at());
    all_arrived = all_arrived && (member->there() || member->arrived_at());
  }
  const auto first = starts.empty() ? TimePoint{} : std::ranges::min(starts);
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    auto& entry = move.members.emplace_back(GroupMember{.command = commands_[i]->value()});
    if (members_.empty()) continue;
    const auto& member = *members_[i];
    entry.predicted = member.predicted();
    entry.by_sync = by_sync_[i];
    entry.note = member.start_note();
    if (member.started_at()) entry.started_after = *member.started_at() - first;
    if (member.arrived_at()) entry.arrived_after = *member.arrived_at() - first;
  }
  move.predicted_arrival_error = arrival_error(predicted);
  const bool all_started = !members_.empty() && std::ranges::all_of(members_, [](const auto& m) {
    return m->there() || m->started_at();
  });
  if (all_started && !starts.empty()) move.start_skew = std::ranges::max(starts) - first;
  move.preparation = preparation_;
  if (move.preparation && !starts.empty()) move.preparation->first_start = first;
  if (all_arrived && !arrivals.empty())
    move.arrival_error = std::ranges::max(arrivals) - std::ranges::min(arrivals);
  return move;
}

}  // namespace axisd
