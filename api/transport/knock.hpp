#pragma once

#include <atomic>
#include <mutex>
#include <string>

#include "buses/clock.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::transport {

/// Whether an address of the daemon still lets clients in, tried as they do it: it connects to itself, and
/// whoever accepts there knows the connection and closes it. That anybody else is let in is an answer, too:
/// whoever floods an address must not have the daemon taken for dead. An address at which it never got in
/// tells nothing: a firewall may stand in between.
class Knock {
 public:
  /// `listening`: of whose address; its descriptor is not used later. `name`: of the address.
  Knock(int listening, std::string name);
  Knock(const Knock&) = delete;

  /// Connects, unless it has done so within the last second and was not answered yet. Never waits. Thread:
  /// one at a time.
  void knock();
  /// Somebody was let in. True: this has; to be closed without a word. Thread: the one that accepts.
  [[nodiscard]] bool let_in(int connection);
  /// Since when nobody was let in, though this has knocked; TimePoint::max(): all is well, or it cannot be
  /// told. Thread: any.
  [[nodiscard]] TimePoint unanswered_since() const;
  /// It was let in once. Thread: any.
  [[nodiscard]] bool got_in() const { return got_in_; }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  const std::string name_;
  std::string target_;  ///< a sockaddr
  FileDescriptor ours_;
  TimePoint knocked_at_{};
  std::mutex mutex_;
  std::string from_;  ///< a sockaddr: of the end that has knocked; empty: it was let in. Under mutex_
  std::atomic<bool> got_in_{false};  ///< once
  std::atomic<TimePoint> unanswered_since_{TimePoint::max()};
};

}  // namespace axisd::transport
