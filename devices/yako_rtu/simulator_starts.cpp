// Starts and stops of the simulated drive: by command (7.6), by terminals (6.1), in PT and PV mode
// (7.3, 7.4).
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "devices/yako_rtu/simulator.hpp"

namespace axisd::yako_rtu {

Plan SimulatedDrive::position_plan(bool absolute) const {
  const std::int64_t value = memory_.get_long(reg::pulses_high, reg::pulses_low);
  const bool from_target =
      behaviour_.start_in_motion_from_target && motor().moving() && motion_.is(Activity::position);
  const auto base = absolute      ? motor().commanded() - motor().counter()
                    : from_target ? motion_.last_target()
                                  : motor().commanded();
  return aimed(
      {.activity = Activity::position,
       .target = base + value,
       .rates = memory_.rates(std::abs(memory_.get_signed(reg::maximum_speed)),
                              memory_.get(reg::acceleration_time), memory_.get(reg::deceleration_time))},
      motor());
}

Plan SimulatedDrive::endless_plan(Activity activity, int direction) const {
  auto plan = position_plan(false);
  plan.activity = activity;
  plan.target.reset();
  plan.direction = direction;
  return plan;
}

/// 7.6.1; only 1, 2, 5 and 6 say what to do (bit 2 has no meaning in speed mode).
Fail SimulatedDrive::start(std::uint16_t command) {
  const auto kind = command & 3U;
  if (kind == 0 || kind == 3) {
    if (behaviour_.reserved_start_refused) return Fail::value;
    if (kind == 0 || !behaviour_.reserved_start_moves) return Fail::none;
  }
  if (kind == 2)
    return begin(endless_plan(Activity::velocity, memory_.get_signed(reg::maximum_speed) < 0 ? -1 : 1));
  return begin(position_plan((command & 4U) != 0));
}

/// What a start in alarm or released gets.
Fail SimulatedDrive::refusal() const {
  return behaviour_.start_refused_when_disabled ? Fail::access : Fail::none;
}

Fail SimulatedDrive::begin(const Plan& plan) {
  if (!enabled() || alarm_.on()) return refusal();
  if (control_mode_ != 0) return Fail::none;
  if (!behaviour_.stop_terminal_only_edge &&
      (terminals_.active(Input::stop) || terminals_.active(Input::emergency_stop)))
    return Fail::none;
  if (motor().moving()) {
    const bool replaceable =
        motion_.is(Activity::position) || motion_.is(Activity::velocity) || motion_.is(Activity::jog);
    if (behaviour_.start_in_motion_refused) return Fail::access;
    if (!behaviour_.start_in_motion || !replaceable) return Fail::none;
  }
  if (plan.rates.cruise <= 0 || blocked(plan.direction)) return Fail::none;
  if (starts_later(plan)) return Fail::none;
  motion_.count_start();
  launch(plan);
  return Fail::none;
}

/// The manual says nothing of the time between a start's reply and the first pulse. A second start in it does
/// nothing, as one in motion.
bool SimulatedDrive::starts_later(const Plan& plan) {
  if (!behaviour_.starts_late || motor().moving()) return false;
  if (later_) return true;
  later_ = {.plan = plan, .due = now_ + std::chrono::milliseconds(80)};
  return true;
}

void SimulatedDrive::start_now() {
  const auto plan = std::exchange(later_, std::nullopt)->plan;
  if (!enabled() || alarm_.on() || motor().moving()) return;
  motion_.count_start();
  plan.activity == Activity::homing ? begin_homing() : launch(plan);
}

void SimulatedDrive::launch(const Plan& plan) {
  homing_.end_pause();
  in_position_ = false;
  motion_.launch(plan);
}

Fail SimulatedDrive::start_homing() {
  if (!enabled() || alarm_.on()) return refusal();
  if (control_mode_ != 0) return Fail::none;
  if (motor().moving()) return behaviour_.start_in_motion_refused ? Fail::access : Fail::none;
  if (!behaviour_.stop_terminal_only_edge &&
      (terminals_.active(Input::stop) || terminals_.active(Input::emergency_stop)))
    return Fail::none;
  if (starts_later({.activity = Activity::homing})) return Fail::none;
  motion_.count_start();
  begin_homing();
  return Fail::none;
}

void SimulatedDrive::begin_homing() {
  motion_.take({.activity = Activity::homing});
  in_position_ = false;
  homing_.begin();
}

void SimulatedDrive::stop_command(bool emergency) {
  if (motion_.is(Activity::homing) && behaviour_.stop_ignored_in_homing) return;
  if ((motion_.is(Activity::pt) || motion_.is(Activity::pv)) && behaviour_.stop_ignored_in_pt_pv) return;
  stop_motion(emergency);
}

void SimulatedDrive::stop_motion(bool emergency) {
  motion_.drop_pending();
  segments_.stop();
  if (homing_.pauses()) finish();
  if (!motor().moving()) return;
  if (emergency) {
    cut();
    return;
  }
  motion_.interrupt();
  homing_.interrupt();
  if (behaviour_.stop_uses_new_deceleration && !motion_.is(Activity::homing))
    motor().brake(position_plan(false).rates.deceleration);
  else
    motor().brake();
}

/// No more pulses, and nothing goes on afterwards.
void SimulatedDrive::cut() {
  motion_.drop_pending();
  segments_.stop();
  if (homing_.pauses()) finish();
  if (!motor().moving()) return;
  motion_.interrupt();
  homing_.interrupt();
  motor().stop(behaviour_.abrupt_stop_slips && !closed_loop());
  on_stopped();
}

void SimulatedDrive::on_stopped() {
  if (const auto plan = motion_.take_pending()) {
    launch(*plan);
    return;
  }
  if (motion_.is(Activity::homing)) {
    if (homing_.on_stopped(now_)) finish();
    return;
  }
  in_position_ = !motion_.stopping() && (motion_.is(Activity::position) || motion_.is(Activity::pt));
  finish();
}

void SimulatedDrive::finish() {
  motion_.finish();
  homing_.end_pause();
  if (behaviour_.in_position_after_stop) in_position_ = true;
}

bool SimulatedDrive::limit_active(int direction) const {
  return terminals_.active(direction > 0 ? Input::positive_limit : Input::negative_limit);
}

bool SimulatedDrive::blocked(int direction) const {
  return memory_.get(reg::overtravel_stop) != 2 && limit_active(direction);
}

void SimulatedDrive::enforce_limits() {
  if (!motor().moving()) return;
  if (motion_.is(Activity::homing) && !homing_.compensates()) {
    if (homing_.ends_at_limit()) cut();
    return;
  }
  if (!blocked(motor().direction())) return;
  cut();
  if (memory_.get(reg::overtravel_stop) == 0 && behaviour_.free_stop_releases) enabled_ = false;
}

/// Of terminals that start something.
void SimulatedDrive::on_motion_edge(const InputEdge& edge) {
  const auto jog = [&](int direction) {
    if (edge.rising)
      begin(endless_plan(Activity::jog, direction));
    else if (motion_.is(Activity::jog) && motor().direction() == direction)
      stop_motion(false);
  };
  switch (edge.function) {
    case Input::position:
      if (edge.rising) begin(position_plan(memory_.get(reg::terminal_move_mode) == 1));
      break;
    case Input::speed:
      if (edge.rising)
        start(2);
      else if (behaviour_.speed_terminal_is_level && motion_.is(Activity::velocity))
        stop_motion(false);
      break;
    case Input::jog_positive:
      jog(1);
      break;
    case Input::jog_negative:
      jog(-1);
      break;
    case Input::homing:
      if (edge.rising) start_homing();
      break;
    case Input::pt_enable:
      if (edge.rising) segments_.select(now_);
      break;
    case Input::pv_enable:
      if (edge.rising)
        segments_.enable_pv(enabled() && !alarm_.on() && !motor().moving());
      else if (!behaviour_.pv_latched)
        segments_.enable_pv(false);
      break;
    default:
      break;
  }
}

void SimulatedDrive::on_edge(const InputEdge& edge) {
  switch (edge.function) {
    case Input::alarm_clear:
      if (edge.rising) clear_alarm();
      break;
    case Input::stop:
      if (edge.rising) stop_motion(false);
      break;
    case Input::emergency_stop:
      if (edge.rising) stop_motion(true);
      break;
    case Input::home:
    case Input::positive_limit:
    case Input::negative_limit:
      if (motion_.is(Activity::homing) && homing_.on_edge(edge, now_)) finish();
      break;
    default:
      on_motion_edge(edge);
      break;
  }
  if (edge.function >= Input::pin0) segments_.pin_changed(now_);
}

/// 7.4: the speed follows the selection, with the time of the newly selected segment; without one the motor
/// brakes.
void SimulatedDrive::update_multi_speed() {
  const int wanted = segments_.wanted_rpm(), runs_at = segments_.running_rpm();
  if (!motion_.is(Activity::pv)) {
    if (wanted == 0 || motor().moving()) return;
    segments_.run_at(wanted);
    begin(segments_.pv_plan());
    return;
  }
  if (motion_.stopping() || wanted == runs_at) return;
  segments_.run_at(wanted);
  if (wanted == 0 || (wanted < 0) != (runs_at < 0)) {
    motion_.interrupt();  // and begins anew from standstill, if there is something to run
    motor().brake();
    return;
  }
  const auto plan = segments_.pv_plan();
  motor().run(plan.direction, segments_.changed(plan, motor().speed()));
}

}  // namespace axisd::yako_rtu
