// What a model folder exports: data that the loader, the schema, the documentation, `check` and `budget`
// walk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/gate.hpp"
#include "buses/task.hpp"
#include "buses/transaction_set.hpp"
#include "devices/bus_kind.hpp"
#include "devices/drive.hpp"

namespace axisd {

struct AxisSettings;

namespace modbus_rtu {
class RtuBus;
}
namespace canopen {
class CanopenBus;
}

struct TerminalSpec {
  std::string_view name;  ///< "X0"; its index in the list is its bit in DriveSample
  /// The only function that it can have, in drive direction, and active high only. Empty: any.
  std::string_view function{};
};

/// A function that a terminal can have. `mirror` names the function that an inverted axis needs instead
/// (M18).
struct TerminalFunctionSpec {
  std::string_view name;  ///< "positive_limit"
  std::uint16_t code;
  std::string_view mirror;      ///< empty: direction does not matter
  bool starts_motion = false;   ///< M3: written only while released and the input is inactive
  std::string_view unusable{};  ///< why the drive has it and axisd never assigns it; empty: it does
};

enum class Access : std::uint8_t { ro, rw, rw_saved, wo };
/// Size and sign of a register or object.
enum class ParameterType : std::uint8_t { u8, i8, u16, i16, u32, i32 };
[[nodiscard]] constexpr std::size_t size_of(ParameterType type) {
  return std::size_t{1} << (static_cast<unsigned>(type) / 2U);
}
[[nodiscard]] constexpr bool is_signed(ParameterType type) { return static_cast<unsigned>(type) % 2U != 0; }
/// One register or object of the catalogue.
struct ParameterSpec {
  std::uint32_t address;  ///< Modbus register, or CANopen index << 8 | sub-index
  std::string_view name;  ///< "start_speed"
  Access access;
  std::int64_t minimum, maximum;
  std::optional<std::int64_t> default_value;
  std::string_view unit;
  std::string_view description;
  /// Of a trigger register (wo) the RPC that does what it does, "AxisService.Stop": such a register is never
  /// written as a parameter. Empty for all others.
  std::string_view instead = {};
  /// How the drive counts. A range with both 65535 and negative numbers is one of any words: unsigned.
  ParameterType type = ParameterType::u16;
};
/// nullptr if the catalogue, which is in order of address, has no such parameter.
const ParameterSpec* find_parameter(std::span<const ParameterSpec> catalogue, std::uint32_t address);

/// How an alarm goes away.
enum class AlarmReset : std::uint8_t { power_cycle, by_itself, by_command };
struct AlarmSpec {
  std::uint16_t code;
  std::string_view name;  ///< "overcurrent"
  AlarmReset reset;
  std::string_view remedy;  ///< what to do
};

/// A key that this model adds to the YAML's `drive:` section.
struct SettingSpec {
  std::string_view key;
  /// "enum", "integer", "boolean", "path"; "objects": what the drive's file says wrongly, by object. Its keys
  /// become settings of their own: "objects.6084h:00.access".
  std::string_view kind;
  std::span<const std::string_view> choices;  ///< of an enum
  std::int64_t minimum = 0, maximum = 0;
  std::string_view default_value;  ///< empty: the drive's value is left alone
  std::string_view description;
  /// Register that holds it: the index of a choice, the integer, or 0/1. Nothing: the driver knows.
  std::optional<std::uint32_t> object = std::nullopt;
  bool required = false;
};

/// One read of holding registers (FC03).
struct RtuRead {
  std::uint16_t address = 0;
  std::uint16_t count = 1;
  bool operator==(const RtuRead&) const = default;
};

/// How a Modbus RTU model is told from others, and how it is set (for identification and the bus scan).
struct RtuIdentification {
  /// What shows the model. Silence means that nobody is there: who has no such registers refuses the read, as
  /// Modbus demands.
  RtuRead read{};
  std::uint16_t code_at = 0;  ///< which of the registers read is the model's code
  std::span<const std::uint16_t> model_codes{};
  /// From the registers read; nullptr: they tell no version.
  std::string (*version)(std::span<const std::uint16_t> registers) = nullptr;
  std::optional<std::uint16_t> has_register{};  ///< read to tell models with the same code apart
  std::optional<std::uint16_t> lacks_register{};
  /// The exception by which it says that a frame was damaged, and nothing of the register that was asked for.
  std::optional<std::uint8_t> damaged_frame{};
  std::optional<std::uint16_t> microstep_register{};
  std::span<const std::int32_t> microstep_codes{};  ///< pulses per revolution in the order of the codes
};

/// How a CANopen model is told from others: its device type (1000h) and identity (1018h).
struct CanIdentification {
  std::uint32_t vendor = 0, product = 0;
  std::uint32_t device_type = 0;                    ///< low 16 bits: profile (402)
  std::uint32_t microstep_object = 0;               ///< index << 8 | sub-index; 0: none
  std::span<const std::int32_t> microstep_codes{};  ///< pulses per revolution in the order of the codes
  [[nodiscard]] constexpr std::uint16_t profile() const { return static_cast<std::uint16_t>(device_type); }
};

/// What a drive's velocities are whole numbers of, or its ramps: what they win of a velocity in a second.
struct VelocityCount {
  double rpm = 0;         ///< r/min of one; 0: each whole r/min can be sent, and ramps are sent as times
  bool of_pulse = false;  ///< where a revolution has one pulse: it is that much less with more
};

/// A homing method that the configuration may name by its number: the drive's own affair, with whatever
/// switches it has.
struct HomingNumber {
  std::int8_t number = 0;
  std::int8_t mirror = 0;  ///< what an inverted axis needs instead (M18); 0: there is none
};

/// How a drive brakes in a quick stop.
enum class QuickStopRamp : std::uint8_t {
  none,     ///< at once
  own,      ///< by a ramp of its own: Drive::quick_stop_time()
  of_stop,  ///< as in a stop, as far as the drive tells
};

/// Ranges that hold for every command of this model.
struct Capabilities {
  std::span<const std::int32_t> pulses_per_revolution;  ///< permitted microstep settings
  int minimum_rpm = 1, maximum_rpm = 3000;
  std::int64_t maximum_pulse_rate_hz = 200'000;  ///< M11
  VelocityCount velocity_count{};                ///< motions are rounded down to it
  /// Of ramps that are sent as rates: a start is rounded down to it, what brakes up; at least one is sent.
  VelocityCount acceleration_count{};
  /// The ramp that the drive brakes with whatever it is told, in acceleration_count, or ms where ramps are
  /// times; 0: it brakes as it is told.
  std::int64_t fixed_deceleration = 0;
  QuickStopRamp quick_stop_ramp = QuickStopRamp::none;
  int minimum_start_rpm = 2, maximum_start_rpm = 300;
  int minimum_time_ms = 0, maximum_time_ms = 2000;
  int minimum_homing_rpm = 5, maximum_homing_rpm = 3000, minimum_search_rpm = 5, maximum_search_rpm = 300;
  int minimum_homing_time_ms = 30;
  std::int32_t maximum_homing_offset_pulses = 65535;
  /// Of targets and distances of single motions, as the drive counts them.
  std::int32_t minimum_target_pulses = std::numeric_limits<std::int32_t>::min();
  std::int32_t maximum_target_pulses = std::numeric_limits<std::int32_t>::max();
  /// Enabling it, and a start after a stop, lead through no mode of operation (6060h = 0): what it does with
  /// its load there is not said.
  bool passes_no_mode = false;
  bool velocity_mode = true;              ///< else jogs and velocity moves are refused
  std::string_view velocity_mode_lack{};  ///< why it has none: what is missing
  bool homing = true;
  std::span<const HomingNumber> homing_numbers{};  ///< in order; none: methods have no numbers
  bool homing_ramp = true;                         ///< homing has an acceleration time of its own
  bool own_deceleration = true;  ///< motions have a deceleration time of their own; else both ramps are alike
  int maximum_segments = 16;     ///< of positions and velocities that the inputs can select
  int minimum_segment_time_ms = 30;
  /// The last approach to a home switch follows the search; else an inverted axis cannot use these methods
  /// (M18), unless the model's setting `home_approach` says otherwise.
  bool home_approach_mirrors = true;
  PositionSource position_source = PositionSource::unspecified;
  bool closed_loop = false;
  bool communication_watchdog = false;
};

/// Everything a factory needs to build a drive.
struct DriveContext {
  Executor executor;
  Clock* clock = nullptr;
  modbus_rtu::RtuBus* rtu = nullptr;       ///< of the axis's bus, for modbus_rtu models
  canopen::CanopenBus* canopen = nullptr;  ///< likewise for canopen models
  std::uint8_t node = 0;
  DriveSetup setup;
};

struct DriveDescriptor {
  std::string_view model;  ///< name in the YAML: "ykd2405pr"
  std::string_view title;
  BusKind bus = BusKind::modbus_rtu;
  std::span<const std::int32_t> bauds;  ///< rates the drive can be set to
  std::uint8_t minimum_node = 1, maximum_node = 127;
  std::span<const TerminalSpec> inputs, outputs;
  std::span<const TerminalFunctionSpec> input_functions, output_functions;
  std::span<const ParameterSpec> parameters;
  std::span<const AlarmSpec> alarms;
  /// Codes that are not listed as the model's. Where there are any, zeros at the end of a code stand for any
  /// hexadecimal digits, as in CiA 301 and CiA 402; 0 is every code.
  std::span<const AlarmSpec> other_alarms{};
  std::span<const SettingSpec> settings;
  Capabilities capabilities;
  PersistSettings saves = PersistSettings::all();  ///< parts of `persist:` that it saves as they are written
  RtuIdentification identification{};              ///< of modbus_rtu models
  std::optional<CanIdentification> can_identification{};  ///< of canopen models; nothing: it cannot be told
  RtuTransactionSet rtu_transactions{};                   ///< of modbus_rtu models
  CanTransactionSet can_transactions{};                   ///< of canopen models
  std::unique_ptr<Drive> (*make)(DriveContext context) = nullptr;
  /// Of a model that a file of the machine builder describes: the descriptor of one drive, made from this one
  /// and its settings. It reads the file: not on the core thread. Then `make` needs it in DriveSetup.
  /// nullptr: this descriptor is every drive's. Errors (invalid_argument): one finding per line.
  Result<std::shared_ptr<const DriveDescriptor>> (*specialise)(
      const DriveDescriptor& model, const std::map<std::string, SettingValue>& settings) = nullptr;
  /// Of a descriptor made from a file: what is wrong there and does not matter, "FILE:LINE: ..." each.
  std::span<const std::string> warnings{};
};

/// All models, generated from the folders. The pointers live as long as the program.
std::span<const DriveDescriptor* const> drive_models();
/// nullptr if there is none of that name.
const DriveDescriptor* find_drive_model(std::string_view model);
/// The axis's own descriptor, or that of its model; nullptr if there is none of that name.
const DriveDescriptor* descriptor_of(const AxisSettings& axis);
/// nullptr if nothing is known of this alarm.
const AlarmSpec* find_alarm(const DriveDescriptor& drive, std::uint16_t code);
/// nullptr if the model has no such function.
const TerminalFunctionSpec* find_function(std::span<const TerminalFunctionSpec> functions,
                                          std::string_view name);

}  // namespace axisd
