// Stops are repeated while the daemon cannot be reached; nothing else ever is.
#pragma once

#include <chrono>

#include "api/axisctl/client.hpp"
#include "api/axisctl/error.hpp"

namespace axisd::axisctl {

/// The attempts of one stop, or of one stop of several axes. Each is executed anew if it arrives, and to stop
/// twice is harmless; all of them carry the same request_id, so that a hold counts once.
class Repetition {
 public:
  /// From now on, as long as `limit`.
  explicit Repetition(std::chrono::nanoseconds limit);
  /// For the next attempt; never nothing.
  [[nodiscard]] std::chrono::nanoseconds left() const;
  /// Waits for the moment of another attempt. False: the time is over. Says on a terminal why it takes so
  /// long.
  bool again(const Client& client, const Failure& failure);
  /// The last failure as that of all attempts.
  [[nodiscard]] Failure in_vain(const Failure& failure) const;

 private:
  std::chrono::nanoseconds limit_;
  std::chrono::steady_clock::time_point deadline_;
  std::chrono::milliseconds pause_;
  bool repeated_ = false, nothing_sent_ = true;
};

/// One stop, repeated for as long as `limit`. `wait`: no time limit for the answer, which takes as long as
/// the standstill. Throws Failure.
template <class Response, class Stub, class Request>
Response repeat_stop(const Client& client,
                     grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                     const Request& request, std::string_view subject, std::chrono::nanoseconds limit,
                     bool wait = false) {
  for (Repetition repetition(limit);;) {
    try {
      return client.call_within(wait ? std::chrono::nanoseconds(0) : repetition.left(), method, request,
                                subject, Lane::stop);
    } catch (const Failure& failure) {
      if (failure.code() != ExitCode::unreachable) throw;
      if (!repetition.again(client, failure)) throw repetition.in_vain(failure);
    }
  }
}

}  // namespace axisd::axisctl
