// PeerClocks, with machines to ask.
#pragma once

#include <optional>
#include <string>

#include "api/cell/clock_samples.hpp"
#include "api/cell/machines.hpp"
#include "api/cell/peer_clocks.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// Asks each entrance that is known for its clock, again and again. Thread: core.
class ClockWatch {
 public:
  /// Both outlive this.
  ClockWatch(Clock& clock, Machines& machines) : clock_(clock), machines_(machines) {}

  void start() { tick(); }
  /// Nobody is asked any more.
  void end() { timer_.reset(); }
  /// As it is known now. Nothing: it is not.
  [[nodiscard]] std::optional<ClockSamples::Offset> of(const std::string& machine) const {
    return clocks_.of(machine, clock_.now());
  }

 private:
  void tick();
  void ask(const std::string& machine);

  Clock& clock_;
  Machines& machines_;
  PeerClocks clocks_;
  Clock::Timer timer_;
  int ticks_ = 0;
};

}  // namespace axisd::cell
