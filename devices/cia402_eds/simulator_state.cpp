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
  const auto [rose, fell] = control_.take(word);
  if (control_.is(PowerState::fault)) {
    if ((rose & fault_reset_bit) != 0) reset_fault();
    return;
  }
  transition(word);
  if (!control_.operates()) return;
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
    control_.enter(PowerState::disabled);
  } else if (!runs) {  // 7, 10, 11
    if (control_.operates())
      quick_stop();
    else if (!control_.is(PowerState::quick_stop))
      control_.enter(PowerState::disabled);
  } else if (control_.is(PowerState::quick_stop)) {
    if (operates) enter_operation();  // 16
  } else if (!on) {                   // 2, 6, 8
    switch_off();
    control_.enter(PowerState::ready);
  } else if (control_.is(PowerState::ready)) {  // 3; the next word does 4
    control_.enter(PowerState::switched_on);
  } else if (operates && control_.is(PowerState::switched_on)) {  // 4
    enter_operation();
  } else if (!operates && control_.operates()) {  // 5
    switch_off();
    control_.enter(PowerState::switched_on);
  }
}

/// The controller takes over where the shaft stands.
void StandardDrive::enter_operation() {
  if (!energised()) {
    const auto here = motor().encoder();  // what the loop holds, not one reading
    motor().power_up();
    motor().set_counter(here);
  }
  motion_.set_last_target(motor().commanded());
  velocity_.release();
  control_.enter(PowerState::operation);
}

/// Without current; what was asked for is forgotten.
void StandardDrive::switch_off() {
  set_points_.drop_all();
  set_points_.end_acknowledgement();
  cut();
}

/// 605Ah: 0 switches off, 1 and 5 brake with 6084h, 2 and 6 with 6085h; 5 and 6 stay in Quick Stop Active.
void StandardDrive::quick_stop() {
  const auto option = objects_.value(0x605A, 2);
  set_points_.drop_all();
  set_points_.end_acknowledgement();
  if (option == 0) {
    switch_off();
    control_.enter(PowerState::disabled);
    return;
  }
  control_.enter(PowerState::quick_stop);
  stop_motion(objects_.ramp(option == 1 || option == 5 ? 0x6084 : 0x6085));
  if (!motor().moving() && option <= 2) control_.enter(PowerState::disabled);
}

/// 605Dh: 1 brakes with 6084h, 2 with 6085h.
void StandardDrive::on_halt(bool halted) {
  if (!halted) {
    if (behaviour_.halt_release_keeps_velocity_at_0) velocity_.hold();
    if (auto plan = set_points_.take_suspended(); plan && control_.mode() == position_mode) begin(*plan);
    return;
  }
  if (motion_.is(Activity::position) && !motion_.stopping() && !behaviour_.halt_release_drops)
    set_points_.suspend(motion_.pending() ? *motion_.pending()
                                          : Plan{.activity = Activity::position,
                                                 .target = motion_.last_target(),
                                                 .rates = objects_.rates(objects_.profile_speed()),
                                                 .shortened = arrival_.limited()});
  mode_changed_ = false;
  stop_motion(objects_.ramp(objects_.value(0x605D, 1) == 1 ? 0x6084 : 0x6085));
}

void StandardDrive::on_start_bit(bool set) {
  if (control_.mode() == position_mode) {
    if (set)
      accept_set_point();
    else
      set_points_.start_fell();
  } else if (control_.mode() == homing_mode) {
    if (set && !control_.halted()) {
      start_homing();
    } else if (!set && motion_.is(Activity::homing) && !behaviour_.homing_goes_on_without_start_bit) {
      stop_motion(objects_.ramp(0x609A));
    }
  }
}

void StandardDrive::set_mode(int mode) {
  if (mode == control_.mode() || (mode == 0 && behaviour_.no_mode_changes_nothing)) return;
  control_.set_mode(mode);
  mode_changed_ = true;
  set_points_.end_acknowledgement();
  velocity_.release();
  arrival_.forget_limit();
  set_points_.drop_all();
  if (behaviour_.homing_attained_forgotten) homing_.forget_attained();
  stop_motion(objects_.ramp(0x6084));
}

bool StandardDrive::target_reached() const {
  if (!control_.operates()) return false;
  if (mode_changed_ && behaviour_.mode_change_is_target_reached) return true;
  if (control_.halted()) return !motor().moving();
  if (control_.mode() == position_mode) return arrival_.in_position(now_);
  if (control_.mode() == homing_mode)
    return !motion_.is(Activity::homing) &&
           (!behaviour_.homing_attained_early || now_ >= homing_.told_from());
  if (control_.mode() != velocity_mode) return false;
  return motion_.is(Activity::velocity) ? motor().cruising() : dictionary_.get(0x60FF) == 0;
}

std::uint16_t StandardDrive::status() const {
  const int mode = control_.mode();
  const bool homed = homing_.attained() && (!behaviour_.homing_attained_late || now_ >= homing_.told_from());
  const bool bit12 = mode == position_mode   ? set_points_.acknowledged() && now_ >= set_points_.shown_from()
                     : mode == velocity_mode ? !motor().moving()
                                             : mode == homing_mode && homed;
  unsigned bits = control_.state_bits();
  const auto set = [&bits](unsigned bit, bool on) { bits |= on ? 1U << bit : 0U; };
  set(4, fault_.code() != 0x3220);                           // voltage enabled
  set(9, server_.state() != simulation::NmtState::stopped);  // remote
  set(10, target_reached());
  set(11, arrival_.limited() || limit_active(1) || limit_active(-1));
  set(12, bit12);
  set(13, mode == homing_mode && homing_.failed());
  return static_cast<std::uint16_t>(bits);
}

/// Fault reaction: the drive switches off (transitions 13 and 14).
void StandardDrive::fail_with(int code) {
  if (control_.is(PowerState::fault)) return;
  switch_off();
  fault_.raise(code);
  control_.enter(PowerState::fault);
  server_.emergency(static_cast<std::uint16_t>(code), error_register_of(code));
}

/// Transition 15.
void StandardDrive::reset_fault() {
  fault_.reset(behaviour_.error_code_kept);
  control_.enter(PowerState::disabled);
  server_.emergency(0, 0);
}

}  // namespace axisd::cia402_eds
