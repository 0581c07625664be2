// The state that an axis shows, from those of its machines.
#pragma once

#include <optional>

#include "devices/axis/snapshot.hpp"
#include "devices/axis/stop_machine.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// What decides the state of an axis, the strongest first.
struct StateSources {
  bool fault = false;
  StopMachine::Shown stop = StopMachine::Shown::nothing;
  AxisState executed = AxisState::standstill;    ///< what the command shows; standstill: none, or no motion
  std::optional<DriveMode> moved_by_terminal{};  ///< the mode in which the drive moves by itself
  bool energised = false;                        ///< by the newest reading
};

/// Total: each combination has its state (PLCopen Motion Control part 1, state diagram). Pure.
AxisState plcopen_state(const StateSources& sources);

}  // namespace axisd
