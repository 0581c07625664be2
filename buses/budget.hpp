// What a bus can promise, computed from what is asked of it. budget.md has the formulas and their sources.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"

namespace axisd {

/// How long something may take: "12.5 ms"; of Duration::max(): "any time".
std::string bound_text(Duration bound);
/// "within 12.5 ms"; of Duration::max(): "without bound".
std::string within_text(Duration bound);

/// What a configuration demands of a bus's budget.
struct BudgetPolicy {
  bool refuse = false;  ///< a configuration that exceeds it; else it is warned of
  /// What threads and operating system may take of a stop's time. An ordinary kernel promises nothing; on two
  /// busy processors 3 ms were seen.
  Duration host_allowance = std::chrono::milliseconds(5);
  std::optional<Duration> stop_bound{};     ///< last frame of a stop of all axes, at the latest
  std::optional<Duration> refresh_bound{};  ///< of each moving axis, while all move
};

/// A bus while `moving` of its axes move, any of which may be starting, and the others rest.
struct LoadBudget {
  int moving = 0;
  double utilisation = 0;      ///< share of the wire's time; on RS-485 where every node answers at once
  double utilisation_max = 0;  ///< the same where every node takes turnaround_max
  /// Between two readings of one axis, at most. Duration::max(): without bound.
  Duration refresh_moving{}, refresh_idle{};
  /// On RS-485, from a start that is asked for, and durably noted, to the last byte of its start frame, at
  /// most, where all that move start at once: one after the other. 0: they do not wait for each other.
  Duration start{};
};

/// A stop of `axes` axes at once, at most; from its request's arrival, without the way that the motors need.
struct StopBudget {
  int axes = 0;
  Duration last_frame{};  ///< to the last byte of the last axis's stop frame
  Duration standstill{};  ///< to the confirmed standstill of all, beyond their deceleration times
};

struct AxisBudget {
  std::string axis;
  Duration refresh_idle{};                          ///< while all others move
  Duration refresh_moving{}, refresh_moving_all{};  ///< while it alone moves; while all do
  StopBudget alone{}, all{};                        ///< it alone; with all others
};

/// All of it for one bus. Durations are worst cases under the assumptions of budget.md.
struct BusBudget {
  std::string bus;
  std::vector<LoadBudget> load;   ///< none moving, 1, ... all
  std::vector<StopBudget> stops;  ///< one axis, 2, ... all
  std::vector<AxisBudget> axes;
  std::vector<std::string> notes;  ///< what the figures leave out, or what may differ from them
};

}  // namespace axisd
