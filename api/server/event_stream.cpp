#include "api/server/event_stream.hpp"

#include <algorithm>
#include <utility>

#include "api/server/event_convert.hpp"

namespace axisd::server {

// Some 20 KiB a message, 100 of commands alone: far below what a client accepts, and enough to catch up
// quickly.
constexpr std::size_t most_events = 256;

EventStream::EventStream(const Services& services, grpc::CallbackServerContext* context,
                         Admission::Ticket ticket, EventQuery query)
    : ReplyStream(services, context, std::move(ticket)),
      events_(services.machine.events()),
      instance_id_(services.machine.info().instance_id),
      query_(std::move(query)) {}

bool EventStream::wanted(const Event& event) const {
  const auto holds = [](const auto& list, const auto& value) {
    return list.empty() || std::ranges::find(list, value) != list.end();
  };
  return holds(query_.axes, event.axis) && holds(query_.kinds, kind_of(event));
}

bool EventStream::next(v1::WatchEventsResponse& to) {
  while (true) {
    const auto batch = events_.events_after(query_.cursor, most_events);
    query_.cursor =
        batch.events.empty() ? std::max(query_.cursor, batch.newest) : batch.events.back().sequence;
    to.set_lost(to.lost() + batch.lost);
    to.set_newest(batch.newest);
    for (const auto& event : batch.events)
      if (wanted(event)) to_proto(event, *to.add_events());
    // A batch that the filters leave empty is no message; the next one may have something.
    if (to.events_size() > 0 || to.lost() > 0 || batch.events.size() < most_events) break;
  }
  // The first message tells that the stream has begun, and where it goes on.
  if (std::exchange(greeted_, true) && to.events_size() == 0 && to.lost() == 0) return false;
  to.set_instance_id(instance_id_);
  to.set_cursor(query_.cursor);
  return true;
}

}  // namespace axisd::server
