// Starts and stops of the simulated drive: by command (7.6), by terminals (6.1), in PT and PV mode
// (7.3, 7.4).
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "devices/yako_rtu/simulator.hpp"

namespace axisd::yako_rtu {

Rates SimulatedDrive::rates(double rpm, double acceleration_ms, double deceleration_ms) const {
  const double pulses = memory_.pulses_per_revolution();
  const double fastest = std::min(3000.0, 12e6 / pulses);  // 0x0023: 200 kHz of pulses
  return simulation::rates_from(memory_.get(reg::start_speed), std::min(rpm, fastest), acceleration_ms,
                                deceleration_ms, pulses);
}

SimulatedDrive::Plan SimulatedDrive::position_plan(bool absolute) const {
  const std::int64_t value = memory_.get_long(reg::pulses_high, reg::pulses_low);
  const bool from_target =
      behaviour_.start_in_motion_from_target && motor_.moving() && activity_ == Activity::position;
  const auto base = absolute      ? motor_.commanded() - motor_.counter()
                    : from_target ? last_target_
                                  : motor_.commanded();
  const auto target = base + value;
  return {.activity = Activity::position,
          .target = target,
          .direction = target < motor_.commanded() ? -1 : 1,
          .rates = rates(std::abs(memory_.get_signed(reg::maximum_speed)),
                         memory_.get(reg::acceleration_time), memory_.get(reg::deceleration_time))};
}

SimulatedDrive::Plan SimulatedDrive::endless_plan(Activity activity, int direction) const {
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
    return begin(endless_plan(Activity::speed, memory_.get_signed(reg::maximum_speed) < 0 ? -1 : 1));
  return begin(position_plan((command & 4U) != 0));
}

/// What a start in alarm or released gets.
Fail SimulatedDrive::refusal() const {
  return behaviour_.start_refused_when_disabled ? Fail::access : Fail::none;
}

Fail SimulatedDrive::begin(const Plan& plan) {
  if (!enabled() || alarm_ != 0) return refusal();
  if (control_mode_ != 0) return Fail::none;
  if (!behaviour_.stop_terminal_only_edge &&
      (terminals_.active(Input::stop) || terminals_.active(Input::emergency_stop)))
    return Fail::none;
  if (motor_.moving()) {
    const bool replaceable =
        activity_ == Activity::position || activity_ == Activity::speed || activity_ == Activity::jog;
    if (behaviour_.start_in_motion_refused) return Fail::access;
    if (!behaviour_.start_in_motion || !replaceable) return Fail::none;
  }
  if (plan.rates.cruise <= 0 || blocked(plan.direction)) return Fail::none;
  if (starts_later(plan)) return Fail::none;
  ++starts_;
  launch(plan);
  return Fail::none;
}

/// The manual says nothing of the time between a start's reply and the first pulse. A second start in it does
/// nothing, as one in motion.
bool SimulatedDrive::starts_later(const Plan& plan) {
  if (!behaviour_.starts_late || motor_.moving()) return false;
  if (later_) return true;
  later_ = {.plan = plan, .due = now_ + std::chrono::milliseconds(80)};
  return true;
}

void SimulatedDrive::start_now() {
  const auto plan = std::exchange(later_, std::nullopt)->plan;
  if (!enabled() || alarm_ != 0 || motor_.moving()) return;
  ++starts_;
  plan.activity == Activity::homing ? begin_homing() : launch(plan);
}

void SimulatedDrive::launch(const Plan& plan) {
  activity_ = last_activity_ = plan.activity;
  homing_due_ = TimePoint::max();
  in_position_ = stopping_ = false;
  pending_.reset();
  const auto distance = plan.target.value_or(0) - motor_.commanded();
  if (plan.target) last_target_ = *plan.target;
  const bool turns = motor_.moving() && plan.direction != motor_.direction();
  const bool too_near = motor_.moving() && plan.target &&
                        static_cast<double>(std::llabs(distance)) < motor_.stopping_distance(plan.rates);
  if (turns || too_near) {
    motor_.brake();
    pending_ = plan;
  } else if (plan.target) {
    motor_.move(distance, plan.rates);
  } else {
    motor_.run(plan.direction, plan.rates);
  }
}

void SimulatedDrive::stop_command(bool emergency) {
  if (activity_ == Activity::homing && behaviour_.stop_ignored_in_homing) return;
  if ((activity_ == Activity::pt || activity_ == Activity::pv) && behaviour_.stop_ignored_in_pt_pv) return;
  stop_motion(emergency);
}

void SimulatedDrive::stop_motion(bool emergency) {
  pending_.reset();
  multi_speed_.on = false;
  segment_due_ = TimePoint::max();
  if (homing_due_ != TimePoint::max()) finish();
  if (!motor_.moving()) return;
  if (emergency) {
    cut();
    return;
  }
  stopping_ = true;
  phase_ = Phase::ending;
  if (behaviour_.stop_uses_new_deceleration && activity_ != Activity::homing)
    motor_.brake(position_plan(false).rates.deceleration);
  else
    motor_.brake();
}

/// No more pulses, and nothing goes on afterwards.
void SimulatedDrive::cut() {
  pending_.reset();
  multi_speed_.on = false;
  segment_due_ = TimePoint::max();
  if (homing_due_ != TimePoint::max()) finish();
  if (!motor_.moving()) return;
  stopping_ = true;
  phase_ = Phase::ending;
  motor_.stop(behaviour_.abrupt_stop_slips && !closed_loop());
  on_stopped();
}

void SimulatedDrive::on_stopped() {
  if (pending_) {
    const auto plan = *pending_;
    // The braking may have carried it past the target.
    auto turned = plan;
    if (plan.target) turned.direction = *plan.target < motor_.commanded() ? -1 : 1;
    launch(turned);
    return;
  }
  if (activity_ == Activity::homing) {
    homing_stopped();
    return;
  }
  in_position_ = !stopping_ && (activity_ == Activity::position || activity_ == Activity::pt);
  finish();
}

void SimulatedDrive::finish() {
  activity_ = Activity::none;
  stopping_ = false;
  homing_due_ = TimePoint::max();
  if (behaviour_.in_position_after_stop) in_position_ = true;
}

bool SimulatedDrive::limit_active(int direction) const {
  return terminals_.active(direction > 0 ? Input::positive_limit : Input::negative_limit);
}

bool SimulatedDrive::blocked(int direction) const {
  return memory_.get(reg::overtravel_stop) != 2 && limit_active(direction);
}

void SimulatedDrive::enforce_limits() {
  if (!motor_.moving()) return;
  if (activity_ == Activity::homing && phase_ != Phase::compensate) {
    homing_limits();
    return;
  }
  if (!blocked(motor_.direction())) return;
  cut();
  if (memory_.get(reg::overtravel_stop) == 0 && behaviour_.free_stop_releases) enabled_ = false;
}

/// Of terminals that start something.
void SimulatedDrive::on_motion_edge(const InputEdge& edge) {
  const auto jog = [&](int direction) {
    if (edge.rising)
      begin(endless_plan(Activity::jog, direction));
    else if (activity_ == Activity::jog && motor_.direction() == direction)
      stop_motion(false);
  };
  switch (edge.function) {
    case Input::position:
      if (edge.rising) begin(position_plan(memory_.get(reg::terminal_move_mode) == 1));
      break;
    case Input::speed:
      if (edge.rising)
        start(2);
      else if (behaviour_.speed_terminal_is_level && activity_ == Activity::speed)
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
      if (edge.rising) select_segment();
      break;
    case Input::pv_enable:
      if (edge.rising)
        multi_speed_.on = enabled() && alarm_ == 0 && !motor_.moving();
      else if (!behaviour_.pv_latched)
        multi_speed_.on = false;
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
      homing_edge(edge);
      break;
    default:
      on_motion_edge(edge);
      break;
  }
  if (edge.function < Input::pin0) return;
  pins_changed_ = now_;
  segment_due_ = TimePoint::max();  // not stable for 5 ms after the PT edge
}

/// 7.3.2: the PINs must be valid 5 ms before and after the PT edge.
void SimulatedDrive::select_segment() {
  segment_ = terminals_.segment();
  if (segment_ != 0 && now_ >= pins_changed_ + std::chrono::milliseconds(5))
    segment_due_ = now_ + std::chrono::milliseconds(5);
}

void SimulatedDrive::start_segment() {
  segment_due_ = TimePoint::max();
  const auto at = [&](std::uint16_t first) { return static_cast<std::uint16_t>(first + segment_ - 1); };
  const std::int64_t value = memory_.get_long(at(reg::segment_pulses_high), at(reg::segment_pulses_low));
  const bool absolute = memory_.get(reg::terminal_move_mode) == 1;
  const auto target = value + motor_.commanded() - (absolute ? motor_.counter() : 0);
  const double time = memory_.get(at(reg::segment_time));
  begin({.activity = Activity::pt,
         .target = target,
         .direction = target < motor_.commanded() ? -1 : 1,
         .rates = rates(memory_.get(at(reg::segment_speed)), time, time)});
}

/// 7.4: the speed follows the selection, with the time of the newly selected segment; without one the motor
/// brakes.
void SimulatedDrive::update_multi_speed() {
  const int segment = multi_speed_.on ? terminals_.segment() : 0;
  const auto at = [&](std::uint16_t first) { return static_cast<std::uint16_t>(first + segment - 1); };
  const int magnitude = segment == 0 ? 0 : memory_.get(at(reg::segment_pv_speed));
  const int direction = terminals_.active(Input::pv_direction) ? -1 : 1;
  const int wanted = direction * magnitude;
  if (activity_ != Activity::pv) {
    if (wanted == 0 || motor_.moving()) return;
    const double time = memory_.get(at(reg::segment_time));
    multi_speed_.rpm = wanted;
    begin({.activity = Activity::pv,
           .target = {},
           .direction = direction,
           .rates = rates(magnitude, time, time)});
    return;
  }
  if (stopping_ || wanted == multi_speed_.rpm) return;
  const bool turns = wanted == 0 || (wanted < 0) != (multi_speed_.rpm < 0);
  multi_speed_.rpm = wanted;
  if (turns) {
    stopping_ = true;  // and begins anew from standstill, if there is something to run
    motor_.brake();
    return;
  }
  const double time = memory_.get(at(reg::segment_time));
  auto next = rates(magnitude, time, time);
  const auto change = std::abs(next.cruise - motor_.speed());
  if (time > 0 && change > 0) next.acceleration = change * 1000 / time;
  motor_.run(direction, next);
}

}  // namespace axisd::yako_rtu
