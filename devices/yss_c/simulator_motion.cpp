// Starts and stops of the simulated drive: position mode (6.2.4), velocity mode (6.2.5), terminals (2030h).
#include <algorithm>
#include <cstdlib>

#include "devices/yss_c/simulator.hpp"

namespace axisd::yss_c {

simulation::Rates SimulatedDrive::rates(double rpm, double acceleration_ms, double deceleration_ms) const {
  const double pulses = pulses_per_revolution();
  const double fastest = std::min(3000.0, 12e6 / pulses);  // 6081h: 200 kHz of pulses
  return simulation::rates_from(static_cast<double>(dictionary_.get(0x200E)), std::min(rpm, fastest),
                                acceleration_ms, deceleration_ms, pulses);
}

SimulatedDrive::SetPoint SimulatedDrive::set_point(bool relative) const {
  return {.value = dictionary_.get(0x607A),
          .relative = relative,
          .rates = rates(static_cast<double>(dictionary_.get(0x6081)),
                         static_cast<double>(dictionary_.get(0x6083)),
                         static_cast<double>(dictionary_.get(0x6084)))};
}

/// A relative set-point that takes over from another counts from the other's target (CiA 402).
SimulatedDrive::Plan SimulatedDrive::plan_of(const SetPoint& point) const {
  const bool from_target = motor_.moving() && activity_ == Activity::position;
  const auto base = !point.relative ? motor_.commanded() - motor_.counter()
                    : from_target   ? last_target_
                                    : motor_.commanded();
  return {.activity = Activity::position, .target = base + point.value, .direction = 1, .rates = point.rates};
}

SimulatedDrive::Plan SimulatedDrive::endless_plan(Activity activity, double rpm, int direction) const {
  return {.activity = activity,
          .target = {},
          .direction = direction,
          .rates = rates(rpm, static_cast<double>(dictionary_.get(0x6083)),
                         static_cast<double>(dictionary_.get(0x6084)))};
}

/// Rising edge of bit 4 in position mode: 607Ah and its neighbours as they are now.
void SimulatedDrive::accept_set_point() {
  if (acknowledged_) return;  // bit 4 did not fall since, or the one before still waits
  const bool at_once = (control_ & 0x20U) != 0;
  const auto point = set_point((control_ & 0x40U) != 0);
  const bool under_way = activity_ == Activity::position && motor_.moving() && !stopping_;
  if (under_way && behaviour_.setpoint_in_motion_ignored) return;
  acknowledged_ = true;
  if (halted()) {
    if (behaviour_.halt_release_resumes) suspended_ = plan_of(point);
  } else if (under_way && !at_once) {
    buffered_ = point;
  } else {
    begin(plan_of(point));
  }
}

/// False: it does not start (not energised, alarm, a limit or a stop terminal in the way).
bool SimulatedDrive::begin(const Plan& plan) {
  auto one = plan;
  if (one.target) one.direction = *one.target < motor_.commanded() ? -1 : 1;
  if (!energised() || alarm_ != 0 || one.rates.cruise <= 0 || limit_active(one.direction)) return false;
  if (!behaviour_.stop_terminal_only_edge && stop_held()) return false;
  ++starts_;
  launch(one);
  return true;
}

void SimulatedDrive::launch(const Plan& plan) {
  activity_ = plan.activity;
  homing_due_ = TimePoint::max();
  reached_ = stopping_ = false;
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

void SimulatedDrive::stop_motion(bool at_once) {
  pending_.reset();
  if (homing_due_ != TimePoint::max()) finish();
  if (!motor_.moving()) return;
  if (at_once) {
    cut();
    return;
  }
  stopping_ = true;
  phase_ = Phase::ending;
  motor_.brake();
}

/// No more pulses, and nothing goes on afterwards.
void SimulatedDrive::cut() {
  pending_.reset();
  buffered_.reset();
  if (homing_due_ != TimePoint::max()) finish();
  if (!motor_.moving()) return;
  stopping_ = true;
  phase_ = Phase::ending;
  motor_.stop(behaviour_.abrupt_stop_slips && !closed_loop());
  on_stopped();
}

void SimulatedDrive::on_stopped() {
  if (pending_) {
    auto plan = *pending_;
    // The braking may have carried it past the target.
    if (plan.target) plan.direction = *plan.target < motor_.commanded() ? -1 : 1;
    launch(plan);
    return;
  }
  if (activity_ == Activity::homing) {
    homing_stopped();
    return;
  }
  const bool arrived = !stopping_ && activity_ == Activity::position;
  finish();
  if (!arrived) return;
  reached_ = true;
  next_set_point();
}

void SimulatedDrive::finish() {
  activity_ = Activity::none;
  stopping_ = false;
  homing_due_ = TimePoint::max();
}

/// The buffer is free again as soon as its set-point is under way.
void SimulatedDrive::next_set_point() {
  if (!buffered_) return;
  auto point = *buffered_;
  buffered_.reset();
  if ((control_ & 0x10U) == 0) acknowledged_ = false;
  begin(plan_of(point));
}

/// 6.2.2: 0Fh is the start command of velocity mode; 60FFh is followed while it runs.
void SimulatedDrive::update_velocity() {
  const bool runs = state_ == State::operation && mode_ == 3 && !halted() && !velocity_held_ && alarm_ == 0;
  const auto wanted = runs ? dictionary_.get(0x60FF) : 0;
  if (activity_ != Activity::velocity) {
    if (wanted == 0 || motor_.moving()) return;
    velocity_ = wanted;
    if (!begin(
            endless_plan(Activity::velocity, static_cast<double>(std::llabs(wanted)), wanted < 0 ? -1 : 1)))
      velocity_held_ = !behaviour_.velocity_resumes_after_terminal;
    return;
  }
  if (stopping_ || wanted == velocity_) return;
  const bool turns = wanted == 0 || (wanted < 0) != (velocity_ < 0);
  velocity_ = wanted;
  if (turns) {
    stopping_ = true;  // and begins anew from standstill, if there is something to run
    motor_.brake();
    return;
  }
  auto next =
      endless_plan(Activity::velocity, static_cast<double>(std::llabs(wanted)), wanted < 0 ? -1 : 1).rates;
  const bool slower = next.cruise < motor_.speed();
  const auto time = static_cast<double>(dictionary_.get(slower ? 0x6084 : 0x6083));
  const auto change = std::abs(next.cruise - motor_.speed());
  if (time > 0 && change > 0) next.acceleration = change * 1000 / time;
  motor_.run(motor_.direction(), next);
}

bool SimulatedDrive::stop_held() const {
  return inputs_.active(input_stop) || inputs_.active(input_stop_at_once);
}

bool SimulatedDrive::limit_active(int direction) const {
  return inputs_.active(direction > 0 ? input_positive_limit : input_negative_limit);
}

/// 200Ah: 0 stops freely, 1 at once.
void SimulatedDrive::enforce_limits() {
  if (!motor_.moving()) return;
  if (activity_ == Activity::homing && phase_ != Phase::compensate) {
    homing_limits();
    return;
  }
  if (!limit_active(motor_.direction())) return;
  velocity_held_ = !behaviour_.velocity_resumes_after_terminal;
  suspended_.reset();
  cut();
  if (dictionary_.get(0x200A) == 0 && behaviour_.free_stop_releases) energised_ = false;
}

void SimulatedDrive::terminal_start(const Plan& plan) {
  if (motor_.moving()) return;
  if (behaviour_.terminals_need_operation && state_ != State::operation) return;
  begin(plan);
}

void SimulatedDrive::on_edge(const simulation::FunctionEdge& edge) {
  const auto stop = [&](bool at_once) {
    if (!edge.rising) return;
    velocity_held_ = !behaviour_.velocity_resumes_after_terminal;
    suspended_.reset();
    buffered_.reset();
    if (activity_ == Activity::homing) homing_error_ = true;
    stop_motion(at_once);
  };
  switch (edge.function) {
    case input_home:
    case input_positive_limit:
    case input_negative_limit:
      homing_edge(edge);
      break;
    case input_enable:
      edge.rising ? energise() : release();
      break;
    case input_alarm_clear:
      if (edge.rising) reset_fault();
      break;
    case input_factory:
      if (edge.rising) dictionary_.restore_factory();
      break;
    case input_stop:
      stop(false);
      break;
    case input_stop_at_once:
      stop(true);
      break;
    default:
      on_motion_edge(edge);
      break;
  }
}

/// Of terminals that start something.
void SimulatedDrive::on_motion_edge(const simulation::FunctionEdge& edge) {
  const auto speed = dictionary_.get(0x60FF);
  const auto jog = [&](int direction) {
    if (edge.rising)
      terminal_start(endless_plan(Activity::jog, static_cast<double>(dictionary_.get(0x6081)), direction));
    else if (activity_ == Activity::jog && motor_.direction() == direction)
      stop_motion(false);
  };
  switch (edge.function) {
    case input_position:
      if (edge.rising) terminal_start(plan_of(set_point((control_ & 0x40U) != 0)));
      break;
    case input_velocity:
      if (edge.rising)
        terminal_start(
            endless_plan(Activity::jog, static_cast<double>(std::llabs(speed)), speed < 0 ? -1 : 1));
      else if (behaviour_.speed_terminal_is_level && activity_ == Activity::jog)
        stop_motion(false);
      break;
    case input_jog_positive:
      jog(1);
      break;
    case input_jog_negative:
      jog(-1);
      break;
    case input_homing:
      if (edge.rising && (state_ == State::operation || !behaviour_.terminals_need_operation)) start_homing();
      break;
    default:
      break;
  }
}

}  // namespace axisd::yss_c
