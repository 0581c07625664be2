#include "api/cell/event_log.hpp"

#include <algorithm>
#include <utility>

namespace axisd::cell {
namespace {

/// Empty: no client has.
const std::string& caused_by(const v1::CellEvent& event) {
  if (event.has_group_move()) return event.group_move().client();
  return event.kind() == v1::CELL_EVENT_KIND_STOP_ALL_RELEASED ? event.stop_all().released_by()
                                                               : event.stop_all().by();
}

}  // namespace

void EventLog::add(v1::CellEvent event) {
  event.set_sequence(++newest_);
  auto& lane = lanes_[event.kind()];
  if (lane.size == most_of_kind) make_room(lane);
  lane.by_client[caused_by(event)].push_back(newest_);
  ++lane.size;
  events_.emplace(newest_, std::move(event));
}

void EventLog::make_room(Lane& lane) {
  const auto most = std::ranges::max_element(lane.by_client, {}, [](const auto& each) {
    // Of equals whoever has the oldest.
    return std::pair(each.second.size(), ~each.second.front());
  });
  events_.erase(most->second.front());
  most->second.pop_front();
  if (most->second.empty()) lane.by_client.erase(most);
  --lane.size;
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
  std::uint64_t lost = 0;
  for (auto event = events_.upper_bound(cursor);
       event != events_.end() && response.events_size() < most_at_once; ++event) {
    lost += event->first - cursor - 1;
    cursor = event->first;
    *response.add_events() = event->second;
  }
  response.set_lost(lost);
  response.set_cursor(cursor);
  return response;
}

}  // namespace axisd::cell
