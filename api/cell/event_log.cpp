#include "api/cell/event_log.hpp"

#include <algorithm>
#include <utility>

namespace axisd::cell {

void EventLog::add(v1::CellEvent event) {
  event.set_sequence(++newest_);
  events_.push_back(std::move(event));
  if (events_.size() > most) events_.pop_front();
}

std::uint64_t EventLog::cursor_of(const v1::WatchEventsRequest& request) const {
  if (request.instance_id() == instance_id_) return std::min(request.after_sequence(), newest_);
  const bool only_new = request.instance_id().empty() && !request.has_after_sequence();
  return only_new ? newest_ : 0;
}

v1::WatchEventsResponse EventLog::after(std::uint64_t& cursor) const {
  v1::WatchEventsResponse response;
  response.set_instance_id(instance_id_);
  response.set_newest(newest_);
  const auto oldest = newest_ - events_.size() + 1;
  if (cursor + 1 < oldest) {
    response.set_lost(oldest - 1 - cursor);
    cursor = oldest - 1;
  }
  const auto end = std::min(newest_, cursor + most_at_once);
  for (; cursor < end; ++cursor) *response.add_events() = events_[cursor + 1 - oldest];
  response.set_cursor(cursor);
  return response;
}

}  // namespace axisd::cell
