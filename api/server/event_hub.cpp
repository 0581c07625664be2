#include "api/server/event_hub.hpp"

#include <utility>

namespace axisd::server {

grpc::ServerWriteReactor<v1::WatchEventsResponse>* EventHub::open(const Services& services,
                                                                  grpc::CallbackServerContext* context,
                                                                  Admission::Ticket ticket,
                                                                  EventQuery query) {
  const auto stream = std::make_shared<EventStream>(services, context, std::move(ticket), std::move(query));
  if (!stream->open()) return nullptr;
  reply_->post([hub = shared_from_this(), stream] {
    std::erase_if(hub->streams_, [](const auto& weak) {
      const auto known = weak.lock();
      return !known || known->over();
    });
    hub->streams_.push_back(stream);
    stream->notified();
  });
  return stream.get();
}

void EventHub::happened() {
  if (handed_over_.exchange(true)) return;
  reply_->post([weak = weak_from_this()] {
    const auto hub = weak.lock();
    if (!hub) return;
    hub->handed_over_ = false;  // before looking: an event that comes meanwhile is handed over again
    for (const auto& known : hub->streams_)
      if (const auto stream = known.lock()) stream->notified();
  });
}

}  // namespace axisd::server
