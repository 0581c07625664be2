// Starts and stops of the simulated drive: position mode (6.2.4), velocity mode (6.2.5), terminals (2030h).
#include <algorithm>
#include <cstdlib>

#include "devices/yss_c/simulator.hpp"
#include "devices/yss_c/simulator_rates.hpp"

namespace axisd::yss_c {

SimulatedDrive::SetPoint SimulatedDrive::set_point(bool relative) const {
  return {.value = dictionary_.get(0x607A),
          .relative = relative,
          .rates = rates_of(dictionary_, static_cast<double>(dictionary_.get(0x6081)),
                            static_cast<double>(dictionary_.get(0x6083)),
                            static_cast<double>(dictionary_.get(0x6084)))};
}

/// A relative set-point that takes over from another counts from the other's target (CiA 402).
Plan SimulatedDrive::plan_of(const SetPoint& point) const {
  const bool from_target = motor().moving() && motion_.is(Activity::position);
  const auto base = !point.relative ? motor().commanded() - motor().counter()
                    : from_target   ? motion_.last_target()
                                    : motor().commanded();
  return {.activity = Activity::position, .target = base + point.value, .direction = 1, .rates = point.rates};
}

Plan SimulatedDrive::endless_plan(Activity activity, double rpm, int direction) const {
  return {.activity = activity,
          .target = {},
          .direction = direction,
          .rates = rates_of(dictionary_, rpm, static_cast<double>(dictionary_.get(0x6083)),
                            static_cast<double>(dictionary_.get(0x6084)))};
}

/// Rising edge of bit 4 in position mode: 607Ah and its neighbours as they are now.
void SimulatedDrive::accept_set_point() {
  if (set_points_.acknowledged()) return;  // bit 4 did not fall since, or the one before still waits
  const auto point = set_point(control_.relative());
  const bool under_way = motion_.positions();
  if (under_way && behaviour_.setpoint_in_motion_ignored) return;
  set_points_.acknowledge();
  if (control_.halted()) {
    if (behaviour_.halt_release_resumes) set_points_.suspend(plan_of(point));
  } else if (under_way && !control_.at_once()) {
    set_points_.buffer(point);
  } else {
    begin(plan_of(point));
  }
}

/// False: it does not start (not energised, alarm, a limit or a stop terminal in the way).
bool SimulatedDrive::begin(const Plan& plan) {
  const auto one = aimed(plan, motor());
  if (!energised() || alarm_.on() || one.rates.cruise <= 0 || limit_active(one.direction)) return false;
  if (!behaviour_.stop_terminal_only_edge && stop_held()) return false;
  motion_.count_start();
  launch(one);
  return true;
}

void SimulatedDrive::launch(const Plan& plan) {
  homing_.end_pause();
  reached_ = false;
  motion_.launch(plan);
}

void SimulatedDrive::start_homing() {
  homing_.set_failed(true);  // until it is done
  if (motor().moving() || !energised() || alarm_.on()) return;
  if (!behaviour_.stop_terminal_only_edge && stop_held()) return;
  if (!homing_.begin()) return;
  motion_.count_start();
  motion_.take({.activity = Activity::homing});
  reached_ = false;
}

void SimulatedDrive::stop_motion(bool at_once) {
  motion_.drop_pending();
  if (homing_.pauses()) finish();
  if (!motor().moving()) return;
  if (at_once) {
    cut();
    return;
  }
  motion_.interrupt();
  homing_.interrupt();
  motor().brake();
}

/// No more pulses, and nothing goes on afterwards.
void SimulatedDrive::cut() {
  motion_.drop_pending();
  set_points_.drop_buffered();
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
  const bool arrived = !motion_.stopping() && motion_.is(Activity::position);
  finish();
  if (!arrived) return;
  reached_ = true;
  next_set_point();
}

void SimulatedDrive::finish() {
  motion_.finish();
  homing_.end_pause();
}

void SimulatedDrive::next_set_point() {
  if (const auto point = set_points_.take_buffered(control_.start())) begin(plan_of(*point));
}

/// 6.2.2: 0Fh is the start command of velocity mode; 60FFh is followed while it runs.
void SimulatedDrive::update_velocity() {
  const bool runs =
      control_.operates() && control_.mode() == 3 && !control_.halted() && !velocity_.held() && !alarm_.on();
  const auto wanted = runs ? dictionary_.get(0x60FF) : 0;
  const auto plan = [&] {
    return endless_plan(Activity::velocity, static_cast<double>(std::llabs(wanted)), wanted < 0 ? -1 : 1);
  };
  if (!motion_.is(Activity::velocity)) {
    if (wanted == 0 || motor().moving()) return;
    velocity_.change_to(wanted);
    if (!begin(plan())) velocity_.hold(!behaviour_.velocity_resumes_after_terminal);
    return;
  }
  if (motion_.stopping() || wanted == velocity_.velocity()) return;
  if (velocity_.change_to(wanted)) {
    motion_.interrupt();  // and begins anew from standstill, if there is something to run
    motor().brake();
    return;
  }
  auto next = plan().rates;
  const bool slower = next.cruise < motor().speed();
  const auto time = static_cast<double>(dictionary_.get(slower ? 0x6084 : 0x6083));
  const auto change = std::abs(next.cruise - motor().speed());
  if (time > 0 && change > 0) next.acceleration = change * 1000 / time;
  motor().run(motor().direction(), next);
}

bool SimulatedDrive::stop_held() const {
  return inputs_.active(input_stop) || inputs_.active(input_stop_at_once);
}

bool SimulatedDrive::limit_active(int direction) const {
  return inputs_.active(direction > 0 ? input_positive_limit : input_negative_limit);
}

/// 200Ah: 0 stops freely, 1 at once.
void SimulatedDrive::enforce_limits() {
  if (!motor().moving()) return;
  if (motion_.is(Activity::homing) && !homing_.compensates()) {
    if (homing_.ends_at_limit()) cut();
    return;
  }
  if (!limit_active(motor().direction())) return;
  velocity_.hold(!behaviour_.velocity_resumes_after_terminal);
  set_points_.drop_suspended();
  cut();
  if (dictionary_.get(0x200A) == 0 && behaviour_.free_stop_releases) energised_ = false;
}

void SimulatedDrive::terminal_start(const Plan& plan) {
  if (motor().moving()) return;
  if (behaviour_.terminals_need_operation && !control_.operates()) return;
  begin(plan);
}

void SimulatedDrive::on_edge(const simulation::FunctionEdge& edge) {
  const auto stop = [&](bool at_once) {
    if (!edge.rising) return;
    velocity_.hold(!behaviour_.velocity_resumes_after_terminal);
    set_points_.drop_all();
    if (motion_.is(Activity::homing)) homing_.set_failed(true);
    stop_motion(at_once);
  };
  switch (edge.function) {
    case input_home:
    case input_positive_limit:
    case input_negative_limit:
      if (motion_.is(Activity::homing) && homing_.on_edge(edge, now_)) finish();
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
    else if (motion_.is(Activity::jog) && motor().direction() == direction)
      stop_motion(false);
  };
  switch (edge.function) {
    case input_position:
      if (edge.rising) terminal_start(plan_of(set_point(control_.relative())));
      break;
    case input_velocity:
      if (edge.rising)
        terminal_start(
            endless_plan(Activity::jog, static_cast<double>(std::llabs(speed)), speed < 0 ? -1 : 1));
      else if (behaviour_.speed_terminal_is_level && motion_.is(Activity::jog))
        stop_motion(false);
      break;
    case input_jog_positive:
      jog(1);
      break;
    case input_jog_negative:
      jog(-1);
      break;
    case input_homing:
      if (edge.rising && (control_.operates() || !behaviour_.terminals_need_operation)) start_homing();
      break;
    default:
      break;
  }
}

}  // namespace axisd::yss_c
