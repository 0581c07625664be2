// One client's TraceBus stream.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "api/server/reply_stream.hpp"
#include "axisd/v1/bus_service.pb.h"

namespace axisd::server {

/// Writes one batch of frames at a time, and asks for the next one once it is written: what waits for a slow
/// reader stays with the bus, and is lost there. Thread: reply.
class TraceStream final : public ReplyStream<v1::TraceBusResponse> {
 public:
  TraceStream(const Services& services, grpc::CallbackServerContext* context, Admission::Ticket ticket,
              std::string bus);
  /// nullptr: the server is shutting down. Thread: gRPC.
  static grpc::ServerWriteReactor<v1::TraceBusResponse>* start(const Services& services,
                                                               grpc::CallbackServerContext* context,
                                                               Admission::Ticket ticket,
                                                               TraceRequest request);

 private:
  bool next(v1::TraceBusResponse& to) override;
  void release() override { token_.reset(); }
  void take(Result<TraceBatch> batch);

  const std::string bus_;
  std::shared_ptr<TraceToken> token_;
  std::optional<TraceBatch> waiting_;  ///< not yet written
};

}  // namespace axisd::server
