#include "api/server/event_validate.hpp"

#include <fmt/format.h>

#include <string>

#include "api/server/validate.hpp"

namespace axisd::server {
namespace {

Result<std::uint64_t> cursor(const v1::WatchEventsRequest& from, Machine& machine) {
  const auto newest = [&] { return machine.events().events_after(0, 0).newest; };
  if (from.instance_id().empty()) return from.has_after_sequence() ? 0 : newest();
  if (from.instance_id() != machine.info().instance_id) return 0;
  if (from.after_sequence() > newest())
    return fail(
        Reason::invalid_argument,
        fmt::format("after_sequence is {}, but the newest event is {}", from.after_sequence(), newest()),
        "give the cursor of a message of this instance_id");
  return from.after_sequence();
}

}  // namespace

Result<EventQuery> event_query(const v1::WatchEventsRequest& from, Machine& machine) {
  EventQuery query;
  for (const auto& axis : from.axes()) {
    if (auto known = find_axis(machine, axis); !known) return fail(std::move(known).error());
    query.axes.push_back(axis);
  }
  for (const auto kind : from.kinds()) {
    if (kind == v1::EVENT_KIND_UNSPECIFIED || !v1::EventKind_IsValid(kind))
      return fail(Reason::invalid_argument, fmt::format("kinds has the unknown value {}", kind),
                  "use the values of EventKind, or none for all");
    query.kinds.push_back(static_cast<v1::EventKind>(kind));
  }
  const auto start = cursor(from, machine);
  if (!start) return fail(start.error());
  query.cursor = *start;
  return query;
}

}  // namespace axisd::server
