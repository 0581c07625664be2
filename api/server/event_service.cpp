#include "api/server/event_service.hpp"

#include <utility>

#include "api/server/event_hub.hpp"
#include "api/server/event_validate.hpp"
#include "api/server/status.hpp"

namespace axisd::server {

EventServiceImpl::EventServiceImpl(const Services& services) : BoundedService(services), services_(services) {
  begin_within_bounds(&EventServiceImpl::WatchEvents);
}

grpc::ServerWriteReactor<v1::WatchEventsResponse>* EventServiceImpl::WatchEvents(
    grpc::CallbackServerContext* context, const v1::WatchEventsRequest* request) {
  using Refused = RefusedStream<v1::WatchEventsResponse>;
  auto query = event_query(*request, services_.machine);
  if (!query) return new Refused(to_status(query.error()));
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::stream);
  if (!ticket) return new Refused(to_status(ticket.error()));
  auto* stream = services_.events.open(services_, context, *std::move(ticket), *std::move(query));
  return stream != nullptr ? stream : new Refused(shutting_down());
}

}  // namespace axisd::server
