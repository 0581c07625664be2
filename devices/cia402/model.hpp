// What distinguishes one CiA 402 drive from another, as data: the driver has no code for any model.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "buses/canopen/object.hpp"
#include "buses/canopen/remote_node.hpp"
#include "devices/cia402/objects.hpp"
#include "devices/cia402/units.hpp"
#include "devices/descriptor.hpp"

namespace axisd::cia402 {

/// Code of a homing method in 6098h.
struct HomingCode {
  HomingMethod method = HomingMethod::home_positive;
  std::int8_t code = 0;
  /// Of drives that number the methods otherwise: taken where `code` is refused as out of range (abort
  /// 0609003xh), and then for all methods.
  std::optional<std::int8_t> alternative{};
};

/// Bits of the status word that CiA 402 leaves to the manufacturer; 0: the drive has no such bit.
struct StatusBits {
  std::uint16_t alarm = 0;             ///< an alarm is active
  std::uint16_t homed = 0;             ///< homing was done
  std::uint16_t set_point_mirror = 0;  ///< bit 4 of the control word, as the drive holds it
  std::uint16_t enabled = 0;           ///< the power stage is on
  std::uint16_t homing_error = 0;      ///< in homing mode: the homing has failed
  std::uint16_t moving = 0;
  std::uint16_t in_position = 0;
};

/// What is written where, to make the drive do something once.
struct MemoryCommand {
  canopen::Object object;
  std::int64_t value = 0;
};

/// Objects that CiA 402 does not have, or not always. Absent: the drive has no such object.
struct VendorObjects {
  std::optional<canopen::Object> moving{};    ///< not 0: the motor turns
  std::optional<canopen::Object> velocity{};  ///< present velocity (606Ch, or the maker's)
  /// Where the drive wants the shaft now (6062h); in pulses, as 6064h. One that a PDO can carry.
  std::optional<canopen::Object> commanded_position{};
  std::optional<canopen::Object> position_window{};  ///< in which it takes a target for reached (6067h)
  /// Up to which it takes a velocity for 0 (606Fh), in the unit of velocities.
  std::optional<canopen::Object> velocity_threshold{};
  std::optional<canopen::Object> inputs{};         ///< levels, bit per terminal in the descriptor's order
  std::optional<canopen::Object> outputs{};        ///< likewise
  std::optional<canopen::Object> start_speed{};    ///< of each ramp, r/min
  std::optional<canopen::Object> microstep{};      ///< index into CanIdentification::microstep_codes
  std::optional<canopen::Object> loop_mode{};      ///< 0 closed loop, 1 open loop
  std::optional<canopen::Object> eeprom_switch{};  ///< 0: writes are saved, 1: they are not
  std::optional<MemoryCommand> save{};             ///< everything, to the EEPROM
  std::optional<MemoryCommand> restore{};          ///< the factory settings
  std::optional<canopen::Object> alarm_clear{};    ///< 1 clears the alarm
  /// 1 zeroes the position. Absent: homing method 35 does, where the drive has it.
  std::optional<canopen::Object> position_clear{};
  std::optional<canopen::Object> hardware_version{}, software_version{};  ///< numbers
  // Terminals: one object for all levels, then one object per terminal's function.
  std::optional<canopen::Object> input_levels{}, first_input_function{};
  std::optional<canopen::Object> output_levels{}, first_output_function{};
};

/// What a drive's values mean.
struct Meaning {
  Units units{};
  /// Of the encoder, where it is not said whether position_window is in counts or in pulses; 0: in pulses.
  std::int64_t counts_per_revolution = 0;
  /// 603Fh and EMCY: `code & alarm_mask` is the alarm's code where `code & ~alarm_mask` is `alarm_prefix`;
  /// everything else is reported as it is.
  std::uint16_t alarm_mask = 0xFFFF, alarm_prefix = 0;
  /// 603Fh is 0 without an alarm. Else (CiA 402) it may hold the last one: the state in 6041h alone tells.
  bool error_code_ends = false;
  /// 605Dh for a stop on the ramp, and for one without: both keep Operation Enabled.
  std::int16_t halt_on_ramp = 1, halt_at_once = 2;
};

/// How a drive's node-ID and bit rate are set by objects. They count from its next power-up.
struct Addressing {
  canopen::Object node{};                           ///< node-ID in use, by switches or custom_node
  canopen::Object custom_node{};                    ///< node-ID beyond those that the switches can set
  canopen::Object custom_bitrate{};                 ///< index into custom_bitrates
  std::span<const std::int32_t> custom_bitrates{};  ///< bit/s
  std::uint8_t minimum_custom_node = 1, maximum_custom_node = 127;
  std::string_view node_switches{};      ///< how they must stand for custom_node to count
  std::string_view bitrate_switches{};   ///< likewise for custom_bitrate
  std::string_view factory_bitrate{};    ///< what applies after the factory settings were restored
  std::uint8_t factory_custom_node = 0;  ///< of a drive as the factory left it; 0: undefined
};

struct Model {
  const DriveDescriptor* descriptor = nullptr;
  canopen::ExpectedIdentity identity{.profile = 402};
  std::span<const HomingCode> homing_codes;
  StatusBits status{};
  VendorObjects objects{};
  Meaning meaning{};
  /// Those of unit_objects() that the drive has: they are compared with `meaning` before it is configured.
  std::span<const canopen::Object> unit_objects{};
  std::optional<Addressing> addressing{};  ///< nothing: only the drive's switches or tools can
  /// Mode in which nothing goes on that a halt interrupted, and nothing begins (M23): profile velocity with
  /// 60FFh = 0. A drive without that mode: homing, without bit 4 of the control word, else none.
  OperationMode neutral_mode = OperationMode::profile_velocity;
  bool halts_in_one_way = false;  ///< 605Dh is missing, or cannot be written
  /// The manual prints an EMCY identifier that is another service's: 1014h is set to 80h + node first (M24).
  bool sets_emergency_id = true;
};

}  // namespace axisd::cia402
