// What the daemon's shutdown has to finish.
#pragma once

#include <grpcpp/support/status.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "buses/clock.hpp"

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
    if (closed_ && calls_.empty()) empty_.notify_all();
  }
  /// Closes all calls, refuses further ones, and waits until all have ended or `until` has come.
  void close_all(const grpc::Status& status, TimePoint until) {
    std::vector<std::shared_ptr<OpenCall>> calls;
    std::unique_lock lock(mutex_);
    closed_ = true;
    for (const auto& [key, weak] : calls_)
      if (auto call = weak.lock()) calls.push_back(std::move(call));
    lock.unlock();
    for (const auto& call : calls) call->close(status);
    calls.clear();
    lock.lock();
    empty_.wait_for(lock, until - monotonic_now(), [this] { return calls_.empty(); });
  }

 private:
  std::mutex mutex_;
  std::condition_variable empty_;
  bool closed_ = false;
  std::unordered_map<const OpenCall*, std::weak_ptr<OpenCall>> calls_;
};

}  // namespace axisd::server
