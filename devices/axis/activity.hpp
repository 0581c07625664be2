// What an axis is executing.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "buses/clock.hpp"
#include "buses/start_turns.hpp"
#include "devices/axis/command.hpp"
#include "devices/axis/command_book.hpp"
#include "devices/axis/motion_machine.hpp"
#include "devices/axis/planner.hpp"
#include "devices/axis/position_tracker.hpp"
#include "devices/axis/start_machine.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// A command that is being executed.
struct Activity {
  CommandPtr command;
  AxisState state = AxisState::standstill;
  std::uint64_t epoch = 0;
  CommandOptions options;
  Plan plan{};
  StartMachine start{};
  std::optional<TimePoint> hold_until{};  ///< jog and held velocity: halts at this time
  bool lease_over = false;                ///< goes on without its lease, and starts nothing more
  TimePoint start_by = TimePoint::max();  ///< no start frame goes out later (M31)
  TimePoint waits_since{};                ///< the time from which start_by counts
  Clock::Timer late{};                    ///< at start_by
  StartTurns::Turn turn{};                ///< of its start, until that was sent
  int number = 0;                         ///< of its start, for UnseenStart
  std::optional<MotionMachine> motion{};  ///< once its start was acknowledged, and it is followed
};
using ActivityPtr = std::shared_ptr<Activity>;

MoveProfile profile_of(const Plan& plan);
/// A start that fails does not undo what was executed before it: homing backs off first.
void tell_part(const Activity& activity, Error& cause);

}  // namespace axisd
