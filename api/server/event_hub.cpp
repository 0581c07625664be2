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
    hub->forget_those_that_are_over();
    hub->streams_.push_back(stream);
    hub->watched_ = true;  // before it looks: what comes from now on is handed over
    stream->notified();
  });
  return stream.get();
}

void EventHub::forget_those_that_are_over() {
  std::erase_if(streams_, [](const auto& weak) {
    const auto known = weak.lock();
    return !known || known->over();
  });
}

void EventHub::happened() {
  if (!watched_ || handed_over_.exchange(true)) return;
  reply_->post([weak = weak_from_this()] {
    const auto hub = weak.lock();
    if (!hub) return;
    hub->handed_over_ = false;  // before looking: an event that comes meanwhile is handed over again
    hub->forget_those_that_are_over();
    hub->watched_ = !hub->streams_.empty();
    for (const auto& known : hub->streams_)
      if (const auto stream = known.lock()) stream->notified();
  });
}

}  // namespace axisd::server
