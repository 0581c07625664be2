// What passes between an axis and its drive, in units and direction of the drive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "devices/setup_values.hpp"

namespace axisd {

struct DriveDescriptor;

/// A drive that was told to start begins to move within this: what it has not begun by then, it does not.
inline constexpr Duration start_window = std::chrono::milliseconds(500);

/// What the drive itself says it is doing.
enum class DriveMode : std::uint8_t { positioning, homing, multi_position, multi_velocity };
enum class PositionSource : std::uint8_t { unspecified, commanded, encoder };

/// One coherent reading of a drive. Pulses and directions are the drive's.
struct DriveSample {
  TimePoint asked_at;     ///< first byte of the request: everything below is at least this fresh
  TimePoint measured_at;  ///< last byte of the reply
  DriveMode mode = DriveMode::positioning;
  bool moving = false;
  bool in_position = false;
  bool homed = false;
  bool enabled = false;
  std::uint16_t alarm_code = 0;  ///< 0: none
  std::int32_t position_pulses = 0;
  /// Where the drive wants the shaft now, if position_pulses is measured and the drive tells this, too.
  std::optional<std::int32_t> commanded_pulses{};
  std::int32_t velocity_rpm = 0;  ///< signed as the drive reports it
  bool negative_direction = false;
  std::uint32_t inputs = 0;  ///< bit per terminal, in the descriptor's order; 1 active
  std::uint32_t outputs = 0;
  bool operator==(const DriveSample&) const = default;
};

/// Requests that made a drive save to its EEPROM, and the registers that they saved. Rather too many than too
/// few.
struct EepromWrites {
  std::uint64_t saves = 0;
  std::uint64_t registers = 0;
};

struct DriveIdentity {
  std::uint32_t model_code = 0;
  std::string version;
};

/// A positioning move, in drive units.
struct MoveProfile {
  std::int32_t target_pulses = 0;  ///< counter value
  int velocity_rpm = 0;            ///< > 0
  int start_rpm = 5;
  Duration acceleration_time{}, deceleration_time{};
};

struct VelocityProfile {
  int velocity_rpm = 0;  ///< signed
  int start_rpm = 5;
  Duration acceleration_time{}, deceleration_time{};
};

struct HomingProfile {
  HomingMethod method = HomingMethod::home_positive;  ///< drive direction
  int velocity_rpm = 0;
  int search_velocity_rpm = 0;
  Duration acceleration_time{};
  std::int32_t offset_pulses = 0;
  std::optional<std::int8_t> number{};  ///< in place of `method`: the drive's own; drive direction
};

/// The drive's segment table in drive units and direction; index 0 is segment 1, unset ones are 0. As many
/// rows as the model has (Capabilities::maximum_segments), or more that only the drive itself can select.
struct DriveSegments {
  struct Row {
    std::int32_t pulses = 0;
    int velocity_rpm = 0;  ///< of the position segment
    Duration acceleration_time{};
    int pv_velocity_rpm = 0;
    bool operator==(const Row&) const = default;
  };
  bool absolute = false;
  std::vector<Row> rows{};
  bool operator==(const DriveSegments&) const = default;
};

/// What the axis wants the drive to be, in drive direction (already mirrored for inverted axes, M18).
struct DriveSetup {
  std::int64_t pulses_per_revolution = 0;
  std::vector<TerminalSettings> inputs, outputs;
  std::optional<HomingProfile> homing;
  PersistSettings persist{};
  Duration reboot_guard{};
  std::map<std::string, SettingValue> model_settings;
  std::shared_ptr<const DriveDescriptor> own_descriptor{};  ///< AxisSettings has it, too
  std::optional<DriveSegments> segments{};
};

/// A parameter by its address: Modbus register, or CANopen index << 8 | sub-index.
struct ParameterValue {
  std::uint32_t address = 0;
  std::int64_t value = 0;
  bool operator==(const ParameterValue&) const = default;
};

/// What the drive no longer holds as it was configured.
struct Drift {
  std::string text;             ///< names what differs; empty: nothing
  bool scale_changed = false;   ///< positions mean something else now
  bool limits_changed = false;  ///< a limit or stop terminal, or what the drive does at one
};

/// Contents of drive memory that no power-up leaves behind: finding them proves that the drive kept its
/// memory, and with it its position and configuration (M6, M7, M20). The model chooses what it is, and how
/// long, up to `longest_mark`. Empty: none. Never zeros alone, nor restart_mark().
using ContinuityMark = std::vector<std::uint16_t>;
inline constexpr std::size_t longest_mark = 16;

/// What becomes of a state that is read again and again. All of it is called on the core thread and must not
/// block.
struct StateWatch {
  Duration period{};  ///< from one reading to the next
  /// This one tells nothing new, and nobody waits for another.
  std::function<bool(const DriveSample&)> goes_on;
  /// When Drive::check_continuity() is to be asked for, where the next reading is asked for at `next` and the
  /// last request waited for so long until it was sent. Not before that reading: later than `next`.
  std::function<TimePoint(TimePoint next, Duration waited)> proof_due;
  /// It succeeded; it was sent then.
  std::function<void(TimePoint)> proven;
};

}  // namespace axisd
