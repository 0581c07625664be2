// Where the answer to a call goes.
#pragma once

#include <grpcpp/support/status.h>

#include <functional>
#include <memory>

namespace axisd::server {

/// A call that waits for the machine: one of gRPC's (PendingCall), or one of the stop lane.
class Reply {
 public:
  /// Fills the response and gives the status. Runs on a thread of the call's own, and only while the response
  /// exists.
  using Fill = std::move_only_function<grpc::Status()>;
  using Job = std::move_only_function<void()>;

  virtual ~Reply() = default;
  /// Answers the client, unless the call has ended; `always` runs before, on the same thread, in any case.
  /// Cheap. Thread: any; meant for the core.
  virtual void complete(Fill fill, Job always = {}) = 0;
};
using ReplyPtr = std::shared_ptr<Reply>;

}  // namespace axisd::server
