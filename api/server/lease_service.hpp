#pragma once

#include "api/server/bounded_service.hpp"
#include "api/server/services.hpp"
#include "axisd/v1/lease_service.grpc.pb.h"

namespace axisd::server {

/// LeaseService: validates, converts, asks the machine. Renewing and releasing do not count among a client's
/// calls in progress: what it waits for must never cost it its leases. Thread: gRPC.
class LeaseServiceImpl final : public BoundedService<v1::LeaseService::CallbackService> {
 public:
  explicit LeaseServiceImpl(const Services& services);

  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;
  Reactor* AcquireLease(Context* context, const v1::AcquireLeaseRequest* request,
                        v1::AcquireLeaseResponse* response) override;
  Reactor* RenewLease(Context* context, const v1::RenewLeaseRequest* request,
                      v1::RenewLeaseResponse* response) override;
  Reactor* ReleaseLease(Context* context, const v1::ReleaseLeaseRequest* request,
                        v1::ReleaseLeaseResponse* response) override;
  Reactor* ListLeases(Context* context, const v1::ListLeasesRequest* request,
                      v1::ListLeasesResponse* response) override;

 private:
  const Services services_;
};

}  // namespace axisd::server
