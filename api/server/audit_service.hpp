#pragma once

#include "api/server/bounded_service.hpp"
#include "api/server/services.hpp"
#include "axisd/v1/audit_service.grpc.pb.h"

namespace axisd::server {

/// AuditService. Thread: gRPC.
class AuditServiceImpl final : public BoundedService<v1::AuditService::CallbackService> {
 public:
  explicit AuditServiceImpl(const Services& services);

  grpc::ServerUnaryReactor* ListAudit(grpc::CallbackServerContext* context,
                                      const v1::ListAuditRequest* request,
                                      v1::ListAuditResponse* response) override;

 private:
  const Services services_;
};

}  // namespace axisd::server
