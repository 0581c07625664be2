#pragma once

#include "api/server/services.hpp"
#include "axisd/v1/bus_service.grpc.pb.h"

namespace axisd::server {

/// BusService. Thread: gRPC.
class BusServiceImpl final : public v1::BusService::CallbackService {
 public:
  explicit BusServiceImpl(const Services& services) : services_(services) {}

  grpc::ServerUnaryReactor* ListBuses(grpc::CallbackServerContext* context,
                                      const v1::ListBusesRequest* request,
                                      v1::ListBusesResponse* response) override;

 private:
  const Services services_;
};

}  // namespace axisd::server
