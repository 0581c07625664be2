// A unary call that waits for the core thread.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>

#include "api/server/reply.hpp"
#include "api/server/services.hpp"

namespace axisd::server {

/// Lives until gRPC is done with it and the machine has called back, whichever is later: a cancelled or
/// expired call ends at once, the command that it started goes on, and its late callback finds a finished
/// call.
///
///   gRPC thread  --start()--> Machine        core thread  --complete()--> reply thread  --Finish--> gRPC
class PendingCall final : public grpc::ServerUnaryReactor,
                          public Reply,
                          public OpenCall,
                          public std::enable_shared_from_this<PendingCall> {
 public:
  /// Asks the machine; must arrange for complete() to be called.
  using Ask = std::function<void(std::shared_ptr<PendingCall> call)>;

  PendingCall(const Services& services, Admission::Ticket ticket);

  /// Begins a call and asks the machine. A call during shutdown is refused without asking. Thread: gRPC.
  static grpc::ServerUnaryReactor* start(const Services& services, grpc::CallbackServerContext* context,
                                         Admission::Ticket ticket, const Ask& ask);

  /// On the reply thread.
  void complete(Fill fill, Job always = {}) override;

  void close(const grpc::Status& status) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  void finish(const grpc::Status& status);

  const std::shared_ptr<ReplyThread> reply_;
  const std::shared_ptr<OpenCalls> calls_;
  Admission::Ticket ticket_;
  bool finished_ = false;              ///< Thread: reply
  std::shared_ptr<PendingCall> self_;  ///< gRPC's share, until OnDone
};

/// Answers at once. Thread: gRPC.
grpc::ServerUnaryReactor* answer(grpc::CallbackServerContext* context, const grpc::Status& status);

}  // namespace axisd::server
