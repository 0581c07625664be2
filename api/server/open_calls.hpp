// What the daemon's shutdown has to finish, and what ends with its client's certificate.
#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "api/server/status.hpp"
#include "buses/clock.hpp"
#include "buses/error.hpp"

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
  /// Why a call may not go on; nothing: it may.
  using Judge = std::function<std::optional<Error>()>;
  /// Between two looks at calls that have a judge.
  static constexpr Duration judged_every = std::chrono::seconds(1);

  /// False: the server is shutting down, the call must not begin. `connection`: as gRPC names it; empty:
  /// it is not counted. `judge`: may be empty; asked by tick().
  [[nodiscard]] bool add(const std::shared_ptr<OpenCall>& call, const std::string& connection,
                         Judge judge = {}) {
    auto shared = judge ? std::make_shared<const Judge>(std::move(judge)) : nullptr;
    const std::lock_guard lock(mutex_);
    if (closed_) return false;
    calls_.emplace(call.get(), Entry{.call = call, .judge = std::move(shared), .connection = connection});
    if (!connection.empty()) ++in_progress_[connection];
    return true;
  }
  /// Its client has only to take its answer.
  void answered(const OpenCall* call) {
    const std::lock_guard lock(mutex_);
    if (const auto found = calls_.find(call); found != calls_.end()) settle(found->second);
  }
  /// gRPC is done with it.
  void remove(const OpenCall* call) {
    const std::lock_guard lock(mutex_);
    if (const auto found = calls_.find(call); found != calls_.end()) {
      settle(found->second);
      calls_.erase(found);
    }
    if (closed_ && calls_.empty()) empty_.notify_all();
  }
  /// Calls of that connection that have not been answered.
  [[nodiscard]] int in_progress(const std::string& connection) {
    const std::lock_guard lock(mutex_);
    const auto found = in_progress_.find(connection);
    return found == in_progress_.end() ? 0 : found->second;
  }
  /// Ends calls that may not go on. When it wants to be called again. Thread: one.
  TimePoint tick(TimePoint now) {
    if (now < next_look_) return next_look_;
    next_look_ = now + judged_every;
    std::vector<std::pair<std::shared_ptr<OpenCall>, std::shared_ptr<const Judge>>> judged;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [key, entry] : calls_)
        if (auto call = entry.judge ? entry.call.lock() : nullptr)
          judged.emplace_back(std::move(call), entry.judge);
    }
    for (const auto& [call, judge] : judged)
      if (const auto error = (*judge)()) call->close(to_status(*error));
    return next_look_;
  }
  /// Closes all calls, refuses further ones, and waits until all have ended or `until` has come.
  void close_all(const grpc::Status& status, TimePoint until) {
    std::vector<std::shared_ptr<OpenCall>> calls;
    std::unique_lock lock(mutex_);
    closed_ = true;
    for (const auto& [key, entry] : calls_)
      if (auto call = entry.call.lock()) calls.push_back(std::move(call));
    lock.unlock();
    for (const auto& call : calls) call->close(status);
    calls.clear();
    lock.lock();
    empty_.wait_for(lock, until - monotonic_now(), [this] { return calls_.empty(); });
  }

 private:
  struct Entry {
    std::weak_ptr<OpenCall> call;
    std::shared_ptr<const Judge> judge;  ///< nullptr: it may always go on
    std::string connection;              ///< empty: it is not counted, or not any more
  };
  /// Under mutex_.
  void settle(Entry& entry) {
    const auto connection = std::exchange(entry.connection, {});
    const auto found = connection.empty() ? in_progress_.end() : in_progress_.find(connection);
    if (found != in_progress_.end() && --found->second == 0) in_progress_.erase(found);
  }

  std::mutex mutex_;
  std::condition_variable empty_;
  bool closed_ = false;
  std::unordered_map<const OpenCall*, Entry> calls_;
  std::unordered_map<std::string, int> in_progress_;  ///< of each connection that has any
  TimePoint next_look_{};                             ///< of tick()
};

}  // namespace axisd::server
