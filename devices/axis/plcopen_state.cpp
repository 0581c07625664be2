#include "devices/axis/plcopen_state.hpp"

namespace axisd {

namespace {

AxisState state_of(DriveMode mode) {
  switch (mode) {
    case DriveMode::homing:
      return AxisState::homing;
    case DriveMode::multi_velocity:
      return AxisState::continuous_motion;
    case DriveMode::positioning:
    case DriveMode::multi_position:
      break;
  }
  return AxisState::discrete_motion;
}

}  // namespace

AxisState plcopen_state(const StateSources& sources) {
  using Shown = StopMachine::Shown;
  if (sources.fault) return AxisState::error_stop;
  if (sources.stop == Shown::stopping) return AxisState::stopping;
  if (sources.executed != AxisState::standstill) return sources.executed;
  // MC_Halt shows DiscreteMotion until the axis rests (PLCopen part 1, 3.6).
  if (sources.stop == Shown::ended_motion) return AxisState::discrete_motion;
  if (sources.moved_by_terminal) return state_of(*sources.moved_by_terminal);
  return sources.energised ? AxisState::standstill : AxisState::disabled;
}

}  // namespace axisd
