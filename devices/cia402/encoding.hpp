// Between the numbers of a CiA 402 drive and those of the drive contract. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "buses/canopen/pdo.hpp"
#include "devices/cia402/model.hpp"
#include "devices/cia402/objects.hpp"
#include "devices/cia402/unit_objects.hpp"
#include "devices/drive.hpp"

namespace axisd::cia402 {

/// Size and sign of an object by the model's dictionary, else by CiA 402.
struct ObjectType {
  std::uint8_t bytes = 2;
  bool is_signed = false;
};
ObjectType type_of(const Model& model, canopen::Object object);

/// The model's dictionary has the object.
bool has(const Model& model, canopen::Object object);

/// The objects that tell a drive's state, in the order in which PDOs carry them.
std::vector<canopen::Object> state_objects(const Model& model);
/// The same in as few PDOs as hold them: at most four objects and 64 bits each (YSS-C manual 6.1.2,
/// chapter 7).
std::vector<canopen::PdoMapping> state_layout(const Model& model);

/// Terminals, by their bits in DriveSample, that the drive shows as 0 while they are active.
struct ActiveLow {
  std::uint32_t inputs = 0, outputs = 0;
};

/// Alarm of a sample whose status word tells of a fault that 603Fh does not name.
constexpr std::uint16_t alarm_without_code = 0xFFFF;

/// Of event PDOs at 1 Mbit/s: a node sends them at least, and at most, this often.
inline constexpr auto event_period = std::chrono::milliseconds(20),
                      inhibit_period = std::chrono::milliseconds(10);
/// 60FFh, 605Dh, the control word as the drive holds it, and the control word with bit 8.
inline constexpr std::uint8_t stop_transfers = 4;
/// What the driver asks of the network for such a drive; `watched`: objects that are looked at for drift.
CanTransactionSet transactions_of(const Model& model, std::uint8_t watched);

/// What state_objects() held, and 2001h where it was read. Times and `mode` are the caller's.
/// `velocity_noise`: r/min that are no motion; 0: velocities are exact, and any is.
DriveSample decode_state(const Model& model, std::int64_t pulses_per_revolution, const Values& values,
                         ActiveLow active_low = {}, int velocity_noise = 0);
/// Whether it moves, by the drive's own word: the maker's bits and objects, else those of CiA 402, which
/// depend on the mode of operation and tell rest alone. Nothing: it does not say. `halted`: it holds halt
/// (control word bit 8).
std::optional<bool> told_motion(const Model& model, const Values& values, bool halted);
/// r/min of an object that holds a velocity.
int decode_velocity(const Model& model, std::int64_t pulses_per_revolution, std::int64_t value);
/// The bit that says "homed", alone: CiA 402's bit 12 means that in homing mode only. Nothing: neither bit
/// tells now.
std::optional<bool> home_bit(const Model& model, const Values& values);
/// The bit that says that homing has failed, in homing mode; false: the drive has none.
bool homing_failed(const Model& model, const Values& values);
/// Alarm code of a 603Fh or EMCY error code; 0: none, or none of the drive's own.
std::uint16_t alarm_of(const Model& model, std::uint16_t error_code);

/// What the objects hold that a start uses: 607Ah, 6081h, 6083h, 6084h, start speed; 0 where a drive has
/// none.
using MotionBlock = std::array<std::int32_t, 5>;
enum MotionField : std::uint8_t { target, speed, acceleration, deceleration, start_speed };
struct MotionObject {
  MotionField field;
  canopen::Object object;
};
/// Those that the drive has, in the order of writing. They stand in RAM.
std::vector<MotionObject> motion_objects(const Model& model);

MotionBlock encode(const Model& model, std::int64_t pulses_per_revolution, const MoveProfile& profile);
/// `present`: what a velocity motion leaves as it is.
MotionBlock encode(const Model& model, std::int64_t pulses_per_revolution, const VelocityProfile& profile,
                   const MotionBlock& present);
/// 60FFh: never faster than `rpm`.
std::int32_t encode_velocity(const Model& model, std::int64_t pulses_per_revolution, int rpm);
/// 6099h:01, 6099h:02, 609Ah, 607Ch, those that the drive has, in this order. The method (6098h) is
/// negotiated.
std::vector<std::pair<canopen::Object, std::int64_t>> encode(const Model& model,
                                                             std::int64_t pulses_per_revolution,
                                                             const HomingProfile& profile);
/// The block after a power-up, by the model's dictionary.
MotionBlock default_block(const Model& model);

}  // namespace axisd::cia402
