// The state that an axis shows, from those of its machines.
#pragma once

#include <optional>

#include "devices/axis/snapshot.hpp"
#include "devices/axis/stop_machine.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// What decides the state of an axis, the strongest first; but a command that is executed shows its own state
/// while the motion before it is halted (StopMachine::Shown::ended_motion).
struct StateSources {
  bool fault = false;
  StopMachine::Shown stop = StopMachine::Shown::nothing;
  AxisState executed = AxisState::standstill;    ///< of the command; standstill: none, or it moves nothing
  std::optional<DriveMode> moved_by_terminal{};  ///< the mode in which the drive moves by itself
  bool energised = false;                        ///< by the newest reading
};

/// Total: each combination has its state (PLCopen Motion Control part 1, state diagram). Pure.
AxisState plcopen_state(const StateSources& sources);

}  // namespace axisd
