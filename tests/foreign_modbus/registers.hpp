// Registers, codes and bits of the ACME S1, a servo drive that does not exist. None of them is a YAKO
// drive's. The only thing that driver and simulator share.
#pragma once

#include <cstdint>

namespace axisd::acme_s1 {

namespace reg {
/// Serial number, model code, version (major * 100 + minor).
inline constexpr std::uint16_t identity = 0x1000;
/// Status, fault, position (low word first), velocity, mode, inputs.
inline constexpr std::uint16_t state = 0x1100, fault = 0x1101, position_low = 0x1102, position_high = 0x1103,
                               velocity = 0x1104, mode = 0x1105, inputs = 0x1106;
/// Kept without supply: counts per revolution, functions of I1 and I2.
inline constexpr std::uint16_t counts = 0x2000, first_input = 0x2001, second_input = 0x2002;
/// Target (low word first), velocity, rise and fall time in ms: what a start uses. In RAM.
inline constexpr std::uint16_t target_low = 0x3000, target_high = 0x3001, profile_velocity = 0x3002,
                               rise_time = 0x3003, fall_time = 0x3004;
inline constexpr std::uint16_t homing_method = 0x3010, homing_velocity = 0x3011;
/// Two words for the master's own use, in RAM. 0 after a power-up.
inline constexpr std::uint16_t tag = 0x3020;
inline constexpr std::uint16_t command = 0x4000, stop = 0x4001, power = 0x4002, fault_reset = 0x4003,
                               declare_zero = 0x4004;
}  // namespace reg

inline constexpr std::uint16_t identity_count = 3, state_count = 7, profile_count = 5, tag_count = 2;
inline constexpr std::uint16_t model_code = 0x5331;
/// Velocities are counted in tenths of 1 r/min.
inline constexpr int counts_per_rpm = 10;
inline constexpr std::int32_t counts_per_revolution = 8192;

namespace status {
inline constexpr std::uint16_t running = 0x0001, at_target = 0x0100, referenced = 0x0200, powered = 0x0400,
                               faulty = 0x8000;
}
namespace mode {
inline constexpr std::uint16_t idle = 0, moving = 3, turning = 5, homing = 9;
}
namespace command {
inline constexpr std::uint16_t move = 0x11, turn = 0x12, home = 0x13;
}
namespace stop {
inline constexpr std::uint16_t ramp = 0x21, quick = 0x22;
}
namespace power {
inline constexpr std::uint16_t on = 0xA5, off = 0x5A;
}
namespace method {
inline constexpr std::uint16_t to_positive = 0x31, to_negative = 0x32;
}
namespace function {
inline constexpr std::uint16_t none = 0x40, home = 0x41, active_low = 0x8000;
}
namespace exception {
inline constexpr std::uint8_t no_register = 0x21, value = 0x22, state = 0x23, damaged_frame = 0x24,
                              no_function = 0x25;
}

}  // namespace axisd::acme_s1
