// The state machine of CiA 402 (IEC 61800-7-201), its words, and faults.
#include <algorithm>
#include <array>
#include <utility>

#include "devices/cia402_eds/simulator.hpp"

namespace axisd::cia402_eds {

namespace {

constexpr unsigned switch_on_bit = 1U << 0U, voltage_bit = 1U << 1U, no_quick_stop_bit = 1U << 2U,
                   operation_bit = 1U << 3U, start_bit = 1U << 4U, fault_reset_bit = 1U << 7U;
constexpr std::uint16_t halt_bit = 1U << 8U;
constexpr int position_mode = 1, velocity_mode = 3, homing_mode = 6;

/// Bits of 1001h by the class of the code (CiA 301 table 26): current, voltage, temperature, profile.
std::uint8_t error_register_of(int code) {
  switch (code >> 12U) {
    case 2:
      return 0x03;
    case 3:
      return 0x05;
    case 4:
      return 0x09;
    case 8:
      return 0x21;
    default:
      return 0x01;
  }
}

}  // namespace

void StandardDrive::control(std::uint16_t word) {
  const auto before = std::exchange(control_, word);
  const auto rose = static_cast<unsigned>(word & ~before), fell = static_cast<unsigned>(before & ~word);
  if (state_ == State::fault) {
    if ((rose & fault_reset_bit) != 0) reset_fault();
    return;
  }
  transition(word);
  if (state_ != State::operation) return;
  // In this order: a set-point given together with halt waits, one given with its release starts.
  if (((rose | fell) & halt_bit) != 0) on_halt((rose & halt_bit) != 0);
  if (((rose | fell) & start_bit) != 0) on_start_bit((rose & start_bit) != 0);
}

/// Transitions 2 to 12 and 16.
void StandardDrive::transition(std::uint16_t word) {
  const bool voltage = (word & voltage_bit) != 0, runs = (word & no_quick_stop_bit) != 0;
  const bool on = (word & switch_on_bit) != 0, operates = on && (word & operation_bit) != 0;
  if (!voltage) {  // 7, 9, 10, 12
    switch_off();
    state_ = State::disabled;
  } else if (!runs) {  // 7, 10, 11
    if (state_ == State::operation)
      quick_stop();
    else if (state_ != State::quick_stop)
      state_ = State::disabled;
  } else if (state_ == State::quick_stop) {
    if (operates) enter_operation();  // 16
  } else if (!on) {                   // 2, 6, 8
    switch_off();
    state_ = State::ready;
  } else if (state_ == State::ready) {  // 3; the next word does 4
    state_ = State::switched_on;
  } else if (operates && state_ == State::switched_on) {  // 4
    enter_operation();
  } else if (!operates && state_ == State::operation) {  // 5
    switch_off();
    state_ = State::switched_on;
  }
}

/// The controller takes over where the shaft stands.
void StandardDrive::enter_operation() {
  if (!energised()) {
    const auto here = motor_.encoder();  // what the loop holds, not one reading
    motor_.power_up();
    motor_.set_counter(here);
  }
  last_target_ = motor_.commanded();
  velocity_held_ = false;
  state_ = State::operation;
}

/// Without current; what was asked for is forgotten.
void StandardDrive::switch_off() {
  suspended_.reset();
  buffered_.reset();
  acknowledged_ = false;
  cut();
}

/// 605Ah: 0 switches off, 1 and 5 brake with 6084h, 2 and 6 with 6085h; 5 and 6 stay in Quick Stop Active.
void StandardDrive::quick_stop() {
  const auto option = value(0x605A, 2);
  suspended_.reset();
  buffered_.reset();
  acknowledged_ = false;
  if (option == 0) {
    switch_off();
    state_ = State::disabled;
    return;
  }
  state_ = State::quick_stop;
  stop_motion(ramp(option == 1 || option == 5 ? 0x6084 : 0x6085));
  if (!motor_.moving() && option <= 2) state_ = State::disabled;
}

/// 605Dh: 1 brakes with 6084h, 2 with 6085h.
void StandardDrive::on_halt(bool halted) {
  if (!halted) {
    if (behaviour_.halt_release_keeps_velocity_at_0) velocity_held_ = true;
    if (auto plan = std::exchange(suspended_, std::nullopt); plan && mode_ == position_mode) begin(*plan);
    return;
  }
  if (activity_ == Activity::position && !stopping_ && !behaviour_.halt_release_drops)
    suspended_ = pending_ ? *pending_
                          : Plan{.activity = Activity::position,
                                 .target = last_target_,
                                 .rates = rates(profile_speed()),
                                 .shortened = limited_};
  if (activity_ == Activity::homing) homing_interrupted_ = true;
  mode_changed_ = false;
  stop_motion(ramp(value(0x605D, 1) == 1 ? 0x6084 : 0x6085));
}

void StandardDrive::on_start_bit(bool set) {
  if (mode_ == position_mode) {
    if (set)
      accept_set_point();
    else if (!buffered_)
      acknowledged_ = false;
  } else if (mode_ == homing_mode) {
    if (set && !halted()) {
      start_homing();
    } else if (!set && activity_ == Activity::homing && !behaviour_.homing_goes_on_without_start_bit) {
      homing_interrupted_ = true;
      stop_motion(ramp(0x609A));
    }
  }
}

void StandardDrive::set_mode(int mode) {
  if (mode == mode_ || (mode == 0 && behaviour_.no_mode_changes_nothing)) return;
  mode_ = mode;
  mode_changed_ = true;
  acknowledged_ = velocity_held_ = limited_ = false;
  suspended_.reset();
  buffered_.reset();
  if (behaviour_.homing_attained_forgotten) attained_ = false;
  stop_motion(ramp(0x6084));
}

/// Bits 0 to 3, 5 and 6.
std::uint16_t StandardDrive::state_bits() const {
  switch (state_) {
    case State::disabled:
      return 0x40;
    case State::ready:
      return 0x21;
    case State::switched_on:
      return 0x23;
    case State::operation:
      return 0x27;
    case State::quick_stop:
      return 0x07;
    case State::fault:
      break;
  }
  return 0x08;
}

bool StandardDrive::target_reached() const {
  if (state_ != State::operation) return false;
  if (mode_changed_ && behaviour_.mode_change_is_target_reached) return true;
  if (halted()) return !motor_.moving();
  if (mode_ == position_mode) return in_position();
  if (mode_ == homing_mode)
    return activity_ != Activity::homing && (!behaviour_.homing_attained_early || now_ >= homing_bits_due_);
  if (mode_ != velocity_mode) return false;
  return activity_ == Activity::velocity ? motor_.cruising() : dictionary_.get(0x60FF) == 0;
}

std::uint16_t StandardDrive::status() const {
  const bool homed = attained_ && (!behaviour_.homing_attained_late || now_ >= homing_bits_due_);
  const bool bit12 = mode_ == position_mode   ? acknowledged_ && now_ >= acknowledgement_due_
                     : mode_ == velocity_mode ? !motor_.moving()
                                              : mode_ == homing_mode && homed;
  unsigned bits = state_bits();
  const auto set = [&bits](unsigned bit, bool on) { bits |= on ? 1U << bit : 0U; };
  set(4, fault_ != 0x3220);                                  // voltage enabled
  set(9, server_.state() != simulation::NmtState::stopped);  // remote
  set(10, target_reached());
  set(11, limited_ || limit_active(1) || limit_active(-1));
  set(12, bit12);
  set(13, mode_ == homing_mode && homing_error_);
  return static_cast<std::uint16_t>(bits);
}

/// Fault reaction: the drive switches off (transitions 13 and 14).
void StandardDrive::fail_with(int code) {
  if (state_ == State::fault) return;
  switch_off();
  fault_ = last_fault_ = code;
  state_ = State::fault;
  server_.emergency(static_cast<std::uint16_t>(code), error_register_of(code));
}

/// Transition 15.
void StandardDrive::reset_fault() {
  fault_ = 0;
  if (!behaviour_.error_code_kept) last_fault_ = 0;
  state_ = State::disabled;
  server_.emergency(0, 0);
}

}  // namespace axisd::cia402_eds
