#pragma once

#include "api/server/bounded_service.hpp"
#include "api/server/services.hpp"
#include "axisd/v1/event_service.grpc.pb.h"

namespace axisd::server {

/// EventService. Thread: gRPC.
class EventServiceImpl final : public BoundedService<v1::EventService::CallbackService> {
 public:
  explicit EventServiceImpl(const Services& services);

  grpc::ServerWriteReactor<v1::WatchEventsResponse>* WatchEvents(
      grpc::CallbackServerContext* context, const v1::WatchEventsRequest* request) override;

 private:
  const Services services_;
};

}  // namespace axisd::server
