#include "daemon/core/event_log.hpp"

#include <algorithm>
#include <utility>

namespace axisd::core {

void EventLog::record(WallTime at, std::string axis, EventContent content) {
  {
    const std::lock_guard lock(mutex_);
    events_.push_back(
        {.sequence = ++newest_, .at = at, .axis = std::move(axis), .content = std::move(content)});
    if (events_.size() > capacity) events_.pop_front();
  }
  if (notify_) notify_();
}

EventSource::Batch EventLog::events_after(std::uint64_t cursor, std::size_t most) const {
  const std::lock_guard lock(mutex_);
  Batch batch{.events = {}, .lost = 0, .newest = newest_};
  if (events_.empty() || cursor >= newest_) return batch;
  const auto oldest = events_.front().sequence;
  if (cursor + 1 < oldest) batch.lost = oldest - cursor - 1;
  const auto first = std::max(cursor + 1, oldest) - oldest;
  const auto count = std::min<std::uint64_t>(most, events_.size() - first);
  const auto begin = events_.begin() + static_cast<std::ptrdiff_t>(first);
  batch.events.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
  return batch;
}

}  // namespace axisd::core
