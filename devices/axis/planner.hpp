// From what a client asks to what a drive is given, with everything that could forbid it. Pure.
#pragma once

#include <cstdint>
#include <optional>

#include "devices/axis/command.hpp"
#include "devices/axis/obstacles.hpp"
#include "devices/axis/position_tracker.hpp"
#include "devices/axis/settings.hpp"
#include "devices/descriptor.hpp"
#include "devices/units/scale.hpp"

namespace axisd {

/// What a motion will be: drive values, what was granted, and how long it should take.
struct Plan {
  MotionValues granted{};
  int velocity_rpm = 0;  ///< drive direction: signed for velocity, positive for positioning
  int start_rpm = 0;
  Duration acceleration_time{}, deceleration_time{};
  std::optional<PositionTracker::Target> target{};  ///< positioning only
  bool trusted = false;  ///< the target means a place only while the position is trusted
  bool positive = true;  ///< axis direction
  bool endless = false;  ///< drive speed mode
  Duration predicted{};  ///< from start to standstill; 0 if endless
};

class Planner {
 public:
  Planner(const AxisSettings& settings, const DriveDescriptor& descriptor, const Scale& scale);

  /// Ramps and speed of any motion. `velocity` in user units per second, sign ignored. Errors: out_of_range
  /// with the permitted range in the axis's unit.
  [[nodiscard]] Result<Plan> profile(double velocity, const MotionValues& asked) const;
  /// Completes a profile for a move to `target`. Errors: out_of_range, soft_limit.
  [[nodiscard]] Result<Plan> move(Plan plan, const PositionTracker::Target& target,
                                  const PositionTracker& tracker) const;
  /// move() without its limits. Precondition: as of that, `target` is within a long move's reach.
  [[nodiscard]] Plan aimed(Plan plan, const PositionTracker::Target& target,
                           const PositionTracker& tracker) const;
  /// All that forbids what profile() and move() are asked for: they fail with the first.
  void check_profile(double velocity, const MotionValues& asked, Obstacles& found) const;
  void check_move(const PositionTracker::Target& target, const PositionTracker& tracker,
                  Obstacles& found) const;
  /// In which direction of the axis a move to `target` goes.
  [[nodiscard]] bool positive(const PositionTracker::Target& target, const PositionTracker& tracker) const;
  /// How long a profile takes over `pulses`.
  [[nodiscard]] Duration duration(const Plan& plan, std::int64_t pulses) const;
  /// The same where a drive is as fast as the profile permits: no reading can show it at its end before.
  [[nodiscard]] Duration soonest(const Plan& plan, std::int64_t pulses) const;
  /// A slower profile that takes `wanted` over `pulses`, as near as the drive's whole r/min and milliseconds
  /// let it; never a shorter ramp. A motion too short for its velocity gets the one that it reaches first: it
  /// ends when predicted.
  [[nodiscard]] Plan stretched(Plan plan, std::int64_t pulses, Duration wanted) const;
  [[nodiscard]] Result<void> check_soft_limits(double target, double from) const;

  [[nodiscard]] double maximum_velocity() const;  ///< of limits and drive, user units per second
  [[nodiscard]] double minimum_velocity() const;
  /// Highest motor speed at this microstep setting: min(3000, 12,000,000 / pulses per revolution) r/min
  /// (M11).
  [[nodiscard]] int maximum_rpm() const;
  /// Pulses. One move spans at most half the 32-bit counter, and what the drive takes as a target: the
  /// counter is zeroed at standstill before a target leaves that.
  [[nodiscard]] std::int64_t longest_move() const;
  /// The drive takes this as a target without its counter being zeroed first.
  [[nodiscard]] bool reachable(std::int64_t counter) const;
  /// How long braking from `velocity` (user units per second) takes where a ramp of `told` is sent; never
  /// less than that. A ramp of the drive's own counts as a day at most.
  [[nodiscard]] Duration braking_time(double velocity, Duration told) const;
  /// Homing in drive direction and drive units; nullopt without `homing:`. Errors: out_of_range.
  [[nodiscard]] Result<std::optional<HomingProfile>> homing() const;

 private:
  struct Ramps {
    Duration acceleration, deceleration;
  };
  [[nodiscard]] Ramps ramps(const MotionValues& asked) const;
  /// r/min of one count.
  [[nodiscard]] double size_of(const VelocityCount& count) const;
  /// What comes of so many r/min in the drive's own counts: never faster.
  [[nodiscard]] double sent_rpm(int rpm) const;
  /// What comes of ramps up to `rpm` in the drive's own counts: how long they take to what is sent of it.
  [[nodiscard]] Ramps sent_ramps(int rpm, const Ramps& told) const;
  [[nodiscard]] Ramps sent_ramps(const Plan& plan) const;
  /// With what will be sent as what is granted.
  [[nodiscard]] Plan granting(Plan plan) const;
  /// Both ramps fit into the way: the duration is exact then.
  [[nodiscard]] bool reaches_speed(const Plan& plan, std::int64_t pulses) const;
  void check_ramp(Duration time, const char* name, Obstacles& found) const;
  [[nodiscard]] Plan at_speed(Plan plan, int rpm) const;
  [[nodiscard]] Plan lengthened(Plan plan, std::int64_t pulses, Duration wanted) const;

  const AxisSettings* settings_;
  const Capabilities* capabilities_;
  const Scale* scale_;
};

/// Duration of a trapezoidal (or triangular) move (manual 7.1). Speeds in pulses per second.
Duration move_duration(double pulses, double start_speed, double speed, Duration acceleration_time,
                       Duration deceleration_time);

/// The same to the moment where the ramps of a triangular move meet as early as they can: move_duration() is
/// a bound there.
Duration soonest_duration(double pulses, double start_speed, double speed, Duration acceleration_time,
                          Duration deceleration_time);

/// The opposite direction for inverted axes (M18).
HomingMethod mirrored(HomingMethod method);
/// In drive direction. Errors (misconfigured): the drive has no such method, or none that mirrors it.
/// Precondition: homing is configured.
Result<std::int8_t> homing_number(const AxisSettings& settings, const Capabilities& capabilities);
/// May this configuration be inverted? Errors: misconfigured, where the drive cannot be mirrored (M18).
Result<void> check_mirror(const AxisSettings& settings, const DriveDescriptor& descriptor);
/// What the drive of this axis has to be, mirrored if inverted.
Result<DriveSetup> drive_setup(const AxisSettings& settings, const DriveDescriptor& descriptor);

}  // namespace axisd
