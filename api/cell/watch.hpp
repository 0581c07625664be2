// Whether the watchdog may be told that the entrance lives.
#pragma once

#include <functional>

#include "buses/clock.hpp"
#include "buses/supervision.hpp"

namespace axisd::cell {

/// Looks, as the daemon does, at those on whom everybody else depends: that this comes round itself shows
/// that the core does. Nothing that it asks can hold it up. Thread: core.
class Watch {
 public:
  /// By the clock.
  struct Progress {
    TimePoint accept_loop;  ///< when it last came round
    TimePoint hand_over;    ///< when gRPC last took in a connection; now if it has them all
  };
  using Ask = std::function<Progress()>;
  /// `state`: for systemd.
  using Tell = std::function<void(const char* state)>;

  /// `clock` outlives this. `interval`: of the watchdog; zero: nobody watches, and only the log is told.
  Watch(Clock& clock, Duration interval, Ask ask, Tell tell);

 private:
  void look();

  Clock& clock_;
  const bool watched_;
  Supervision supervision_;
  Ask ask_;
  Tell tell_;
  Clock::Timer timer_;
};

}  // namespace axisd::cell
