// Where calls go, as gRPC's threads see it.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "api/cell/machine_link.hpp"
#include "buses/clock.hpp"
#include "buses/latency_histogram.hpp"

namespace axisd::cell {

/// What was passed on to one machine, since the start. Thread: any.
struct RouteTally {
  std::atomic<std::uint64_t> good{0};     ///< calls that ended with OK
  std::atomic<std::uint64_t> failed{0};   ///< with anything else, by whomever
  std::atomic<std::uint64_t> refused{0};  ///< that the entrance did not pass on
  std::atomic<int> open{0};
  std::atomic<std::uint64_t> bytes_in{0}, bytes_out{0};  ///< of messages, to the machine and from it
};

/// One machine. Immutable.
struct Route {
  Way way;
  bool open = false;  ///< it is known whom the connection leads to, and it answers
  std::string why{};  ///< it is not open
  std::shared_ptr<RouteTally> tally{};
};

/// All machines, by their names. Immutable.
struct Routes {
  std::map<std::string, Route, std::less<>> machines;
};

/// The routes as they are now, and how long calls take. The core replaces the routes, as a whole. Thread:
/// any.
class RouteTable {
 public:
  explicit RouteTable(std::string own) : own_(std::move(own)) {}

  [[nodiscard]] const std::string& own() const { return own_; }
  [[nodiscard]] std::shared_ptr<const Routes> now() const {
    const std::lock_guard lock(mutex_);
    return routes_;
  }
  void replace(std::shared_ptr<const Routes> routes) {
    const std::lock_guard lock(mutex_);
    routes_ = std::move(routes);
  }

  /// A call with one answer has ended, so long after it came.
  void note(Duration duration) {
    const std::lock_guard lock(mutex_);
    durations_.add(duration);
  }
  [[nodiscard]] LatencyHistogram durations() const {
    const std::lock_guard lock(mutex_);
    return durations_;
  }
  /// Calls refused for a name that nobody has, a loop, metadata, or a certificate.
  std::atomic<std::uint64_t> refused{0};
  /// Calls refused because their caller has too many open.
  std::atomic<std::uint64_t> too_many{0};

 private:
  const std::string own_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Routes> routes_ = std::make_shared<Routes>();  ///< under mutex_, as the rest
  LatencyHistogram durations_;
};

}  // namespace axisd::cell
