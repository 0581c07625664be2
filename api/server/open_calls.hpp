// What the daemon's shutdown has to finish.
#pragma once

#include <grpcpp/support/status.h>

#include <memory>
#include <mutex>
#include <unordered_map>

namespace axisd::server {

/// A call that waits for something other than its client.
class OpenCall {
 public:
  virtual ~OpenCall() = default;
  /// Ends the call soon, with `status`, if it has not ended. Thread: any.
  virtual void close(const grpc::Status& status) = 0;
};

/// All open calls. Thread: any.
class OpenCalls {
 public:
  /// False: the server is shutting down, the call must not begin.
  [[nodiscard]] bool add(const std::shared_ptr<OpenCall>& call) {
    const std::lock_guard lock(mutex_);
    if (!closed_) calls_.emplace(call.get(), call);
    return !closed_;
  }
  void remove(const OpenCall* call) {
    const std::lock_guard lock(mutex_);
    calls_.erase(call);
  }
  /// Closes all calls and refuses further ones.
  void close_all(const grpc::Status& status) {
    std::unordered_map<const OpenCall*, std::weak_ptr<OpenCall>> calls;
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
      calls.swap(calls_);
    }
    for (const auto& [key, weak] : calls)
      if (const auto call = weak.lock()) call->close(status);
  }

 private:
  std::mutex mutex_;
  bool closed_ = false;
  std::unordered_map<const OpenCall*, std::weak_ptr<OpenCall>> calls_;
};

}  // namespace axisd::server
