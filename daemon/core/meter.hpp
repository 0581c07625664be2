#pragma once

#include <boost/smart_ptr/atomic_shared_ptr.hpp>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "buses/class_statistics.hpp"
#include "daemon/core/machine_core.hpp"
#include "daemon/core/tallies.hpp"
#include "devices/axis/stop_delays.hpp"

namespace axisd::core {

/// What only the core knows of a bus.
struct BusReading {
  BusStatus status;
  StatisticsByClass classes{};
  double load = 0;              ///< share of the last 10 s that it was occupied
  std::size_t quarantined = 0;  ///< nodes that are asked now and then only, because they do not answer
  StopDelays stops{};
};

/// What only the core knows of a machine. Immutable once published.
struct MachineReading {
  std::vector<BusReading> buses;
  Tallies tallies;
  Duration longest_handler{};  ///< of the core, in the last minute
  bool journal_fails = false;  ///< and motion is refused for it
};
/// boost's pointer: libstdc++ 12's atomic shared_ptr is a data race to ThreadSanitizer.
using MachineReadingPtr = boost::shared_ptr<const MachineReading>;

/// Publishes a reading each second, so that who wants numbers never asks the core. Thread: core, but
/// latest().
class Meter {
 public:
  static constexpr Duration period = std::chrono::seconds(1);
  /// What longest_handler looks back on, so that no reader who comes at least so often misses one.
  static constexpr std::size_t handlers_kept = 60;

  /// `take_longest_handler`: since it was last called. Both outlive this.
  Meter(Clock& clock, const MachineCore& machine, std::function<Duration()> take_longest_handler);
  Meter(const Meter&) = delete;

  /// Before the core runs, or on it.
  void start();
  /// Nothing is read any more.
  void close() { timer_.reset(); }
  /// nullptr before start(). Thread: any.
  [[nodiscard]] MachineReadingPtr latest() const { return latest_.load(); }

 private:
  void read();
  [[nodiscard]] BusReading read_bus(BusStatus status) const;

  Clock* clock_;
  const MachineCore* machine_;
  std::function<Duration()> take_longest_handler_;
  std::deque<Duration> handlers_;  ///< the longest of each period
  Clock::Timer timer_;
  boost::atomic_shared_ptr<const MachineReading> latest_;
};

}  // namespace axisd::core
