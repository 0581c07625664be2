#include "daemon/core/event_log.hpp"

#include <type_traits>
#include <utility>
#include <variant>

namespace axisd::core {

namespace {

/// Whose share an event counts against.
std::string owner_of(const std::string& axis, const EventContent& content) {
  if (const auto* change = std::get_if<CommandChange>(&content)) return change->command->client;
  if (const auto* change = std::get_if<StopHoldChange>(&content)) return change->hold.holder;
  if (const auto* change = std::get_if<InhibitChange>(&content)) return change->by;
  return axis;
}

template <std::size_t... Kind>
std::vector<FairLane> lanes(std::index_sequence<Kind...> /*kinds*/) {
  const auto capacity_of = []<class Content>(std::type_identity<Content>) {
    const bool frequent = std::is_same_v<Content, TerminalEdge> || std::is_same_v<Content, StateChange> ||
                          std::is_same_v<Content, CommandChange>;
    return frequent ? EventLog::capacity : EventLog::capacity_of_rare;
  };
  return {FairLane(capacity_of(std::type_identity<std::variant_alternative_t<Kind, EventContent>>()))...};
}

}  // namespace

EventLog::EventLog() : lanes_(lanes(std::make_index_sequence<std::variant_size_v<EventContent>>())) {}

void EventLog::record(WallTime at, std::string axis, EventContent content) {
  tallies_.add(axis, content);
  // Nobody but this thread writes newest_.
  Event event{.sequence = newest_ + 1, .at = at, .axis = std::move(axis), .content = std::move(content)};
  if (kept_) kept_(event);
  {
    const std::lock_guard lock(mutex_);
    newest_ = event.sequence;
    events_.erase(lanes_[event.content.index()].add(owner_of(event.axis, event.content), newest_));
    events_.emplace_hint(events_.end(), newest_, std::move(event));
  }
  if (notify_) notify_();
}

EventSource::Batch EventLog::events_after(std::uint64_t cursor, std::size_t most) const {
  const std::lock_guard lock(mutex_);
  Batch batch{.events = {}, .lost = 0, .newest = newest_};
  for (auto next = events_.upper_bound(cursor); next != events_.end() && batch.events.size() < most; ++next) {
    // The newest is always kept: what is lost lies before an event.
    batch.lost += next->first - cursor - 1;
    cursor = next->first;
    batch.events.push_back(next->second);
  }
  return batch;
}

}  // namespace axisd::core
