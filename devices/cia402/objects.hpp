// Objects of CiA 402 that the driver uses, and the bits of the control word.
#pragma once

#include <cstdint>

#include "buses/canopen/object.hpp"

namespace axisd::cia402 {

namespace object {

using canopen::Object;

inline constexpr Object emergency_id{0x1014, 0}, heartbeat_time{0x1017, 0};
inline constexpr Object error_code{0x603F, 0}, control_word{0x6040, 0}, status_word{0x6041, 0},
    halt_option{0x605D, 0}, mode{0x6060, 0}, mode_display{0x6061, 0}, position{0x6064, 0},
    target_position{0x607A, 0}, home_offset{0x607C, 0}, profile_velocity{0x6081, 0}, acceleration{0x6083, 0},
    deceleration{0x6084, 0}, quick_stop_deceleration{0x6085, 0}, homing_method{0x6098, 0},
    homing_speed{0x6099, 1}, homing_search_speed{0x6099, 2}, homing_acceleration{0x609A, 0},
    target_velocity{0x60FF, 0};

}  // namespace object

/// Values of 6060h and 6061h.
enum class OperationMode : std::int8_t {
  none = 0,
  profile_position = 1,
  profile_velocity = 3,
  homing = 6,
};

/// Bits of the control word beside those of the state machine.
namespace control {

inline constexpr std::uint16_t state_bits = 0x000F;
inline constexpr std::uint16_t start = 0x0010;  ///< new set-point; homing start
/// Operation Enabled, with the rise of that bit.
inline constexpr std::uint16_t start_word = 0x001F;
inline constexpr std::uint16_t fault_reset = 0x0080;
inline constexpr std::uint16_t halt = 0x0100;

}  // namespace control

/// Bits of the status word that CiA 402 defines for all drives.
namespace status {

inline constexpr std::uint16_t target_reached = 0x0400;
/// Set-point acknowledged (position), speed is 0 (velocity), homing attained (homing).
inline constexpr std::uint16_t mode_specific = 0x1000;

}  // namespace status

}  // namespace axisd::cia402
