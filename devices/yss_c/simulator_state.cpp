// The CiA 402 machine of the simulated drive (6.2.1, 6.2.2) and its alarms (8).
#include <algorithm>
#include <array>

#include "devices/yss_c/simulator.hpp"

namespace axisd::yss_c {

namespace {

constexpr std::array<int, 5> alarm_codes{1, 2, 3, 4, 5};

// Control word.
constexpr unsigned switch_on = 1, voltage = 2, no_quick_stop = 4, operation_bit = 8, start_bit = 0x10,
                   reset_bit = 0x80, halt_bit = 0x100;

}  // namespace

std::span<const int> SimulatedDrive::alarms() const { return alarm_codes; }

void SimulatedDrive::control(std::uint16_t word) {
  const auto before = std::exchange(control_, word);
  const auto rises = static_cast<std::uint16_t>(word & ~before),
             falls = static_cast<std::uint16_t>(before & ~word);
  if ((rises & reset_bit) != 0) reset_fault();
  const bool was_operating = state_ == State::operation;
  transition(word);
  if (state_ != State::operation) {
    if ((word & start_bit) == 0) acknowledged_ = false;
    return;
  }
  if (was_operating && ((rises | falls) & halt_bit) != 0) on_halt((word & halt_bit) != 0);
  if ((rises & start_bit) != 0 && (was_operating || behaviour_.start_of_enabled_edge)) on_start_bit(true);
  if ((falls & start_bit) != 0) on_start_bit(false);
}

/// Table of 6.2.1, the numbers are its transitions.
void SimulatedDrive::transition(std::uint16_t word) {
  if (state_ == State::fault) return;
  if ((word & voltage) == 0) {  // 7, 9, 10, 12
    disable_voltage();
    return;
  }
  if ((word & no_quick_stop) == 0) {
    if (state_ != State::operation) {  // 7, 10
      if (state_ != State::quick_stop) disable_voltage();
      return;
    }
    if (behaviour_.quick_stop_releases) {
      disable_voltage();
      return;
    }
    leave_operation(true);  // 11
    state_ = State::quick_stop;
    return;
  }
  const bool on = (word & switch_on) != 0, operates = (word & operation_bit) != 0;
  if (!on) {
    if (state_ == State::quick_stop) return;
    if (state_ != State::disabled && state_ != State::ready) {  // 6, 8
      leave_operation(false);
      energised_ = false;
    }
    state_ = State::ready;  // 2
    return;
  }
  if (state_ == State::operation && !operates) {  // 5
    leave_operation(!behaviour_.disable_operation_cuts);
    state_ = State::switched_on;
  }
  if (state_ == State::ready) {  // 3
    state_ = State::switched_on;
    energised_ = true;  // 6.2.2: at 07 already
  }
  if (operates && (state_ == State::switched_on || state_ == State::quick_stop)) {  // 4, 16
    state_ = State::operation;
    velocity_held_ = false;
  }
}

void SimulatedDrive::disable_voltage() {
  leave_operation(false);
  energised_ = false;
  state_ = State::disabled;
}

/// What was asked for in Operation Enabled ends, by the ramp or at once.
void SimulatedDrive::leave_operation(bool brakes) {
  suspended_.reset();
  buffered_.reset();
  if (state_ == State::operation && behaviour_.velocity_cleared_on_disable) dictionary_.set(0x60FF, 0, 0);
  stop_motion(!brakes);
}

void SimulatedDrive::on_halt(bool halted) {
  if (!halted) {
    if (!behaviour_.halt_release_restarts_velocity) velocity_held_ = true;
    if (const auto plan = std::exchange(suspended_, std::nullopt); plan && mode_ == 1) {
      begin(*plan);
    } else if (mode_ == 6 && behaviour_.halt_release_resumes && phase_ == Phase::ending && homing_error_ &&
               (control_ & start_bit) != 0) {
      start_homing();
    }
    return;
  }
  const bool at_once = dictionary_.get(0x605D) == 1;
  const bool cuts = at_once && behaviour_.halt_edge_cuts_ramp;
  if (activity_ == Activity::none || (stopping_ && !pending_ && !cuts)) return;
  if (activity_ == Activity::position && !stopping_ && behaviour_.halt_release_resumes)
    suspended_ =
        pending_
            ? *pending_
            : Plan{.activity = Activity::position, .target = last_target_, .rates = set_point(false).rates};
  if (activity_ == Activity::homing) homing_error_ = true;
  stop_motion(at_once);
}

/// 6.2.4, 6.2.6: control bit 4.
void SimulatedDrive::on_start_bit(bool set) {
  if (mode_ == 1) {
    if (set)
      accept_set_point();
    else if (!buffered_)
      acknowledged_ = false;
  } else if (mode_ == 6) {
    if (set && !halted())
      start_homing();
    else if (!set && activity_ == Activity::homing && phase_ != Phase::ending &&
             !behaviour_.homing_goes_on_after_start_bit) {
      homing_error_ = true;
      stop_motion(false);
    }
  }
}

void SimulatedDrive::set_mode(int mode) {
  if (mode == mode_) return;
  mode_ = mode;
  velocity_held_ = acknowledged_ = false;
  buffered_.reset();
  if (!behaviour_.mode_change_keeps_setpoint) suspended_.reset();
  stop_motion(false);
}

/// 200Fh = 1 and its terminal: outside of the state machine, which does not move by it.
void SimulatedDrive::energise() {
  if (alarm_ == 0) energised_ = true;
}

void SimulatedDrive::release() {
  if (behaviour_.release_keeps_state || state_ == State::fault) {
    cut();
    energised_ = false;
    return;
  }
  disable_voltage();
}

/// 6.2.1: bits 0..3, 5, 6.
std::uint16_t SimulatedDrive::state_bits() const {
  switch (state_) {
    case State::disabled:
      return static_cast<std::uint16_t>(0x40U | ((control_ & no_quick_stop) != 0 ? 0x20U : 0U));
    case State::ready:
      return 0x21;
    case State::switched_on:
      return 0x23;
    case State::operation:
      return 0x27;
    case State::quick_stop:
      return 0x07;
    default:
      return 0x08;
  }
}

bool SimulatedDrive::target_reached() const {
  if (halted()) return !motor_.moving();
  if (mode_ == 1) return in_position() && !behaviour_.reached_only_bit15;
  if (mode_ == 6) return !motor_.moving();
  if (mode_ != 3 || state_ != State::operation) return false;
  return activity_ == Activity::velocity ? motor_.cruising() && !stopping_
                                         : !motor_.moving() && dictionary_.get(0x60FF) == 0;
}

/// 6.2.1, 6.2.2, and the tables of 6.2.4 to 6.2.6; bits 4 and 9 as CiA 402, where the manual is silent.
std::uint16_t SimulatedDrive::status() const {
  const auto& b = behaviour_;
  const bool homing = mode_ == 6;
  const bool limit = limit_active(1) || limit_active(-1);
  const bool bit12 = mode_ == 1   ? acknowledged_
                     : mode_ == 3 ? !motor_.moving()
                                  : homing && homed_ && !motor_.moving() && !b.homed_only_bit8;
  unsigned bits = state_bits() | 0x200U;
  const auto set = [&bits](unsigned bit, bool on) { bits |= on ? 1U << bit : 0U; };
  set(4, alarm_ != 3);
  set(6, b.bit6_always);
  set(7, alarm_ != 0 && !b.bit7_is_warning);
  set(8, homed_ && !b.homed_only_bit12);
  set(10, target_reached());
  set(11, b.bit11_is_limit ? limit : (control_ & start_bit) != 0);
  set(12, bit12);
  const bool shows_error = b.bit13_not_enabled || (homing && b.bit13_is_homing_error);
  set(13, shows_error ? homing && homing_error_ : energised());
  set(14, motor_.moving());
  set(15, mode_ == 1 && in_position() && !b.reached_only_bit10);
  return static_cast<std::uint16_t>(bits);
}

void SimulatedDrive::raise_alarm(int code) {
  if (code == 0) {
    cause_ = 0;
    // Chapter 8: these recover by themselves.
    if ((alarm_ == 2 || alarm_ == 3) && !behaviour_.fault_needs_reset) clear_alarm();
  } else {
    cause_ = code == 2 || code == 3 ? code : 0;
    if (powered_) show_alarm(code);
  }
  if (ready()) step(now_);
}

void SimulatedDrive::show_alarm(int code) {
  if (alarm_ == 1 || alarm_ == 5) return;  // chapter 8: stays until the next power-up
  alarm_ = code;
  leave_operation(false);
  state_ = State::fault;
  if (!behaviour_.alarm_keeps_torque) energised_ = false;
  if (ready()) report_alarm();
}

/// 1001h by CiA 301: bit 0 always, current, voltage, manufacturer's.
void SimulatedDrive::report_alarm() {
  constexpr std::array<std::uint8_t, 6> registers{0, 0x03, 0x05, 0x05, 0x81, 0x81};
  server_.emergency(static_cast<std::uint16_t>(0xFF00 + alarm_),
                    registers.at(static_cast<std::size_t>(alarm_)));
}

/// Chapter 8: 4 can be reset, 1 and 5 end with the supply, 2 and 3 with their cause.
void SimulatedDrive::reset_fault() {
  const bool recovers = (alarm_ == 2 || alarm_ == 3) && cause_ == 0;
  if (alarm_ == 4 || recovers) clear_alarm();
}

void SimulatedDrive::clear_alarm() {
  alarm_ = 0;
  energised_ = false;
  state_ = State::disabled;
  if (ready()) server_.emergency(0, 0);
}

}  // namespace axisd::yss_c
