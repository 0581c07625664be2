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
  const auto [rises, falls] = control_.take(word);
  if ((rises & reset_bit) != 0) reset_fault();
  const bool was_operating = control_.operates();
  transition(word);
  if (!control_.operates()) {
    if (!control_.start()) set_points_.end_acknowledgement();
    return;
  }
  if (was_operating && ((rises | falls) & halt_bit) != 0) on_halt((word & halt_bit) != 0);
  if ((rises & start_bit) != 0 && (was_operating || behaviour_.start_of_enabled_edge)) on_start_bit(true);
  if ((falls & start_bit) != 0) on_start_bit(false);
}

/// Table of 6.2.1, the numbers are its transitions.
void SimulatedDrive::transition(std::uint16_t word) {
  if (control_.is(PowerState::fault)) return;
  if ((word & voltage) == 0) {  // 7, 9, 10, 12
    disable_voltage();
    return;
  }
  if ((word & no_quick_stop) == 0) {
    if (!control_.operates()) {  // 7, 10
      if (!control_.is(PowerState::quick_stop)) disable_voltage();
      return;
    }
    if (behaviour_.quick_stop_releases) {
      disable_voltage();
      return;
    }
    leave_operation(true);  // 11
    control_.enter(PowerState::quick_stop);
    return;
  }
  const bool on = (word & switch_on) != 0, operates = (word & operation_bit) != 0;
  if (!on) {
    if (control_.is(PowerState::quick_stop)) return;
    if (!control_.is(PowerState::disabled) && !control_.is(PowerState::ready)) {  // 6, 8
      leave_operation(false);
      energised_ = false;
    }
    control_.enter(PowerState::ready);  // 2
    return;
  }
  if (control_.operates() && !operates) {  // 5
    leave_operation(!behaviour_.disable_operation_cuts);
    control_.enter(PowerState::switched_on);
  }
  if (control_.is(PowerState::ready)) {  // 3
    control_.enter(PowerState::switched_on);
    energised_ = true;  // 6.2.2: at 07 already
  }
  if (operates && (control_.is(PowerState::switched_on) || control_.is(PowerState::quick_stop))) {  // 4, 16
    control_.enter(PowerState::operation);
    velocity_.release();
  }
}

void SimulatedDrive::disable_voltage() {
  leave_operation(false);
  energised_ = false;
  control_.enter(PowerState::disabled);
}

/// What was asked for in Operation Enabled ends, by the ramp or at once.
void SimulatedDrive::leave_operation(bool brakes) {
  set_points_.drop_all();
  if (control_.operates() && behaviour_.velocity_cleared_on_disable) dictionary_.set(0x60FF, 0, 0);
  stop_motion(!brakes);
}

void SimulatedDrive::on_halt(bool halted) {
  if (!halted) {
    if (!behaviour_.halt_release_restarts_velocity) velocity_.hold();
    if (const auto plan = set_points_.take_suspended(); plan && control_.mode() == 1) {
      begin(*plan);
    } else if (control_.mode() == 6 && behaviour_.halt_release_resumes && homing_.interrupted() &&
               homing_.failed() && control_.start()) {
      start_homing();
    }
    return;
  }
  const bool at_once = dictionary_.get(0x605D) == 1;
  const bool cuts = at_once && behaviour_.halt_edge_cuts_ramp;
  const bool ends_already = motion_.stopping() && !motion_.pending();
  if (motion_.is(Activity::none) || (ends_already && !cuts)) return;
  if (motion_.is(Activity::position) && !motion_.stopping() && behaviour_.halt_release_resumes)
    set_points_.suspend(motion_.pending() ? *motion_.pending()
                                          : Plan{.activity = Activity::position,
                                                 .target = motion_.last_target(),
                                                 .rates = set_point(false).rates});
  if (motion_.is(Activity::homing)) homing_.set_failed(true);
  stop_motion(at_once);
}

/// 6.2.4, 6.2.6: control bit 4.
void SimulatedDrive::on_start_bit(bool set) {
  if (control_.mode() == 1) {
    if (set)
      accept_set_point();
    else
      set_points_.start_fell();
  } else if (control_.mode() == 6) {
    if (set && !control_.halted())
      start_homing();
    else if (!set && motion_.is(Activity::homing) && !homing_.interrupted() &&
             !behaviour_.homing_goes_on_after_start_bit) {
      homing_.set_failed(true);
      stop_motion(false);
    }
  }
}

void SimulatedDrive::set_mode(int mode) {
  if (mode == control_.mode()) return;
  control_.set_mode(mode);
  velocity_.release();
  set_points_.end_acknowledgement();
  set_points_.drop_buffered();
  if (!behaviour_.mode_change_keeps_setpoint) set_points_.drop_suspended();
  stop_motion(false);
}

/// 200Fh = 1 and its terminal: outside of the state machine, which does not move by it.
void SimulatedDrive::energise() {
  if (!alarm_.on()) energised_ = true;
}

void SimulatedDrive::release() {
  if (behaviour_.release_keeps_state || control_.is(PowerState::fault)) {
    cut();
    energised_ = false;
    return;
  }
  disable_voltage();
}

bool SimulatedDrive::target_reached() const {
  if (control_.halted()) return !motor().moving();
  if (control_.mode() == 1) return in_position() && !behaviour_.reached_only_bit15;
  if (control_.mode() == 6) return !motor().moving();
  if (control_.mode() != 3 || !control_.operates()) return false;
  return motion_.is(Activity::velocity) ? motor().cruising() && !motion_.stopping()
                                        : !motor().moving() && dictionary_.get(0x60FF) == 0;
}

/// 6.2.1, 6.2.2, and the tables of 6.2.4 to 6.2.6; bits 4 and 9 as CiA 402, where the manual is silent.
std::uint16_t SimulatedDrive::status() const {
  const auto& b = behaviour_;
  const int mode = control_.mode();
  const bool homing = mode == 6;
  const bool limit = limit_active(1) || limit_active(-1);
  const bool bit12 = mode == 1   ? set_points_.acknowledged()
                     : mode == 3 ? !motor().moving()
                                 : homing && homing_.homed() && !motor().moving() && !b.homed_only_bit8;
  unsigned bits = control_.state_bits() | 0x200U;
  const auto set = [&bits](unsigned bit, bool on) { bits |= on ? 1U << bit : 0U; };
  set(4, alarm_.shown() != 3);
  if (control_.is(PowerState::disabled)) set(5, control_.no_quick_stop());
  set(6, b.bit6_always);
  set(7, alarm_.on() && !b.bit7_is_warning);
  set(8, homing_.homed() && !b.homed_only_bit12);
  set(10, target_reached());
  set(11, b.bit11_is_limit ? limit : control_.start());
  set(12, bit12);
  const bool shows_error = b.bit13_not_enabled || (homing && b.bit13_is_homing_error);
  set(13, shows_error ? homing && homing_.failed() : energised());
  set(14, motor().moving());
  set(15, mode == 1 && in_position() && !b.reached_only_bit10);
  return static_cast<std::uint16_t>(bits);
}

void SimulatedDrive::raise_alarm(int code) {
  alarm_.set_cause(code);
  if (code == 0) {
    // Chapter 8: these recover by themselves.
    if (alarm_.of_voltage() && !behaviour_.fault_needs_reset) clear_alarm();
  } else if (supply_.on()) {
    show_alarm(code);
  }
  if (ready()) step(now_);
}

void SimulatedDrive::show_alarm(int code) {
  if (!alarm_.show(code)) return;
  leave_operation(false);
  control_.enter(PowerState::fault);
  if (!behaviour_.alarm_keeps_torque) energised_ = false;
  if (ready()) report_alarm();
}

/// 1001h by CiA 301: bit 0 always, current, voltage, manufacturer's.
void SimulatedDrive::report_alarm() {
  constexpr std::array<std::uint8_t, 6> registers{0, 0x03, 0x05, 0x05, 0x81, 0x81};
  server_.emergency(static_cast<std::uint16_t>(0xFF00 + alarm_.shown()),
                    registers.at(static_cast<std::size_t>(alarm_.shown())));
}

void SimulatedDrive::reset_fault() {
  if (alarm_.can_be_cleared()) clear_alarm();
}

void SimulatedDrive::clear_alarm() {
  alarm_.clear();
  energised_ = false;
  control_.enter(PowerState::disabled);
  if (ready()) server_.emergency(0, 0);
}

}  // namespace axisd::yss_c
