#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "devices/setup_values.hpp"
#include "devices/units/scale.hpp"

namespace axisd {

using std::chrono::milliseconds;

struct DriveDescriptor;

/// One row of the drive's own table of positions (multi-position, PT; RTU manuals 7.3). User units.
struct PositionSegment {
  int number = 1;                                  ///< 1..16, as the terminals pin0..pin4 select it
  double target = 0;                               ///< distance, or position with SegmentSettings::absolute
  double velocity = 0;                             ///< per second, > 0
  Duration acceleration_time = milliseconds(100);  ///< and deceleration; shared with the velocity segment
  bool operator==(const PositionSegment&) const = default;
};

/// One row of the drive's table of velocities (multi-speed, PV; 7.4); pv_direction selects the direction.
struct VelocitySegment {
  int number = 1;
  double velocity = 0;  ///< per second, > 0
  Duration acceleration_time = milliseconds(100);
  bool operator==(const VelocitySegment&) const = default;
};

struct SegmentSettings {
  bool absolute = false;  ///< what position segments and moves started by terminals mean
  std::vector<PositionSegment> positions{};
  std::vector<VelocitySegment> velocities{};
  bool operator==(const SegmentSettings&) const = default;
};

/// A brake that an output of the drive works (M2). The drive switches the output with its power stage.
struct BrakeSettings {
  Duration release_time{};  ///< after the power stage is on: the axis does not move before
  Duration engage_time{};   ///< after it is off: Disable is not done before
};

struct LimitSettings {
  std::optional<double> position_minimum, position_maximum;  ///< user units; both or none
  double velocity = 0;                                       ///< user units per second, > 0, required
  Duration acceleration_time = milliseconds(100);  ///< from start speed to velocity; the drives take a time
  std::optional<Duration> deceleration_time;       ///< default: acceleration_time
  int start_speed_rpm = 5;                         ///< r/min
  std::uint64_t eeprom_saves_per_day = 100;        ///< > 0, of what EepromBudget counts
};

struct HomingSettings {
  HomingMethod method = HomingMethod::home_positive;
  double velocity = 0;         ///< user units per second
  double search_velocity = 0;  ///< user units per second
  Duration acceleration_time = milliseconds(100);
  double position = 0;               ///< position at home, user units
  double offset = 0;                 ///< signed compensation after home, user units
  std::optional<double> backoff;     ///< bounded move away from an already active switch, user units > 0
  std::optional<double> max_travel;  ///< user units > 0
  Duration timeout = std::chrono::seconds(60);
  /// A method of the drive's own (Capabilities::homing_numbers), in axis direction; then `method` is not
  /// used.
  std::optional<std::int8_t> number{};
};

/// What an axis does when the lease under which it is commanded ends (M16).
enum class LeaseLoss : std::uint8_t {
  halt,
  stop,
  disable,  ///< stop, confirm standstill, release the power stage
  finish    ///< lets a move or homing that has started end; anything else halts
};

/// How often the canary is read, whatever the polling period: at least every second (M7), less what the wire
/// takes.
inline constexpr Duration continuity_period = milliseconds(800);
/// A proof older than that says nothing of a sample: more than a reading waits for on a line that is only
/// slow.
inline constexpr Duration continuity_forgotten = milliseconds(2000);
/// How often an axis is read where the end of a motion is awaited. Less than any reading takes on RS-485; on
/// CAN the state may be known already.
inline constexpr Duration fastest_poll = milliseconds(2);

struct AxisSettings {
  std::string name;
  std::string bus;
  std::uint8_t node = 1;
  std::string model;
  ScaleSettings scale{};
  LimitSettings limits{};
  std::optional<HomingSettings> homing{};
  std::vector<TerminalSettings> inputs{}, outputs{};
  bool vertical = false;  ///< `load: vertical` (M2)
  LeaseLoss on_lease_loss = LeaseLoss::halt;
  bool stop_escalation_release = false;  ///< `stop_escalation: release` (M13)
  bool require_trust = true;             ///< absolute moves need a trusted position
  double jog_travel = 0;          ///< user units; longest jog of an axis whose position is unknown (M16)
  double position_tolerance = 0;  ///< user units; 0: one pulse
  std::optional<Duration> turnaround_max{};  ///< RS-485: of this drive; nothing: its line's
  Duration poll_moving = milliseconds(20);
  Duration poll_idle = milliseconds(200);
  Duration reboot_guard = milliseconds(100);        ///< M6; below the drive's shortest boot time
  Duration stop_margin = milliseconds(300);         ///< beyond the deceleration time, before escalating
  Duration start_within = std::chrono::seconds(2);  ///< from acceptance to the first start frame (M31)
  Duration drift_check = std::chrono::seconds(10);  ///< how often the terminals' functions are read again
  PersistSettings persist{};
  BrakeSettings brake{};
  std::optional<SegmentSettings> segments{};             ///< nothing: the drive's table is left alone
  std::map<std::string, SettingValue> model_settings{};  ///< by the descriptor's schema
  /// Of a model that is described by a file (DriveDescriptor::specialise); nothing: the model's.
  std::shared_ptr<const DriveDescriptor> own_descriptor{};
  /// Of the content of that file: another one has another.
  std::size_t own_descriptor_source = 0;
};

}  // namespace axisd
