// What an axis is made of.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "devices/axis/axis_environment.hpp"
#include "devices/axis/axis_face.hpp"
#include "devices/axis/command.hpp"
#include "devices/axis/planner.hpp"
#include "devices/axis/position_tracker.hpp"
#include "devices/axis/settings.hpp"
#include "devices/axis/terminals.hpp"
#include "devices/descriptor.hpp"
#include "devices/drive.hpp"
#include "devices/units/scale.hpp"

namespace axisd {

/// What never changes while an axis lives, and what follows from that alone. All parts of the axis know it.
/// Thread: core.
struct AxisContext {
  AxisContext(AxisEnvironment environment, AxisSettings axis_settings,
              const DriveDescriptor& drive_descriptor, std::unique_ptr<Drive> its_drive, AxisFacePtr its_face,
              bool is_simulated);
  ~AxisContext();
  AxisContext(const AxisContext&) = delete;

  AxisEnvironment env;
  AxisSettings settings;
  const DriveDescriptor* descriptor;
  Scale scale;
  Terminals terminals;
  Planner planner;
  std::unique_ptr<Drive> drive;
  AxisFacePtr face;
  std::shared_ptr<AxisGate> gate;  ///< that of the face
  bool simulated;

  [[nodiscard]] Error error(Reason reason, std::string message, std::string remedy = {}) const;
  /// "{what} alarm 2 (overvoltage)", with what there is to do.
  [[nodiscard]] Error alarm_error(std::uint16_t code, std::string_view what) const;
  [[nodiscard]] Error not_trusted(std::string message) const;
  [[nodiscard]] Error direction_blocked(bool positive) const;
  [[nodiscard]] Error moved_before_start() const;
  /// Another axis of the same name, or none, takes its place.
  [[nodiscard]] Error reloading() const;
  /// What is begun is not gone on with: somebody else may be about to take the drive over.
  [[nodiscard]] Error ending() const;
  /// "axisctl enable feeder": what a person can do about it.
  [[nodiscard]] std::string shell(std::string_view command, std::string_view rest = {}) const;
  /// Jogs and velocity moves are refused on a drive without velocity mode. Errors: not_supported.
  [[nodiscard]] Result<void> check_velocity_mode() const;

  [[nodiscard]] std::int64_t home_offset() const;
  /// This offset of the position is that of home, as far as a reading tells (M30).
  [[nodiscard]] bool is_from_home(std::int64_t offset) const;
  /// The position follows a shaft that is turned while the motor is released: in closed loop only, and where
  /// that is known (M20).
  [[nodiscard]] bool counts_while_released() const;
  /// What a terminal does while nobody looks would not show: homing zeroes the counter, a release lets the
  /// shaft be turned uncounted (M20).
  [[nodiscard]] bool terminal_may_void_position() const;
  /// Terminals could move or release the drive between two readings. Without such ones only that happens
  /// which the canary would show.
  [[nodiscard]] bool may_move_by_itself() const;
  /// A measured position comes to its target so late, at most, after the drive has sent its last pulse (M30).
  [[nodiscard]] Duration settling() const;
  /// Pulses from its target at which the axis has arrived: `position_tolerance`, and at least what the drive
  /// itself takes for in position.
  [[nodiscard]] std::int64_t target_tolerance() const;
  /// The function of the terminal that homing searches for. Precondition: homing is configured.
  [[nodiscard]] std::string_view homing_switch() const;

  [[nodiscard]] double velocity_of(const MotionValues& with) const;
  /// A rotary axis goes the shorter way round.
  [[nodiscard]] PositionTracker::Target target_of(const MoveAbsoluteRequest& request,
                                                  const PositionTracker& from) const;
};

}  // namespace axisd
