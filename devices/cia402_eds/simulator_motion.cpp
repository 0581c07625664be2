// Starts and stops of the simulated standard drive: profile position and profile velocity mode.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "devices/cia402_eds/simulator.hpp"

namespace axisd::cia402_eds {

/// 607Dh in the motor's numbers; nothing: the end of the range is no limit, and a range without room is none.
std::optional<std::int64_t> StandardDrive::soft_limit(int direction) const {
  if (dictionary_.get(0x607D, 1) >= dictionary_.get(0x607D, 2)) return std::nullopt;
  const auto limit = dictionary_.get(0x607D, direction > 0 ? 2 : 1);
  const std::int64_t end =
      direction > 0 ? std::numeric_limits<std::int32_t>::max() : std::numeric_limits<std::int32_t>::min();
  if (limit == end) return std::nullopt;
  return motor().commanded() - motor().counter() + limit;
}

/// A relative set-point counts from the target before it.
Plan StandardDrive::position_plan() const {
  const auto base = control_.relative() ? motion_.last_target() : motor().commanded() - motor().counter();
  Plan plan{.activity = Activity::position,
            .target = base + dictionary_.get(0x607A),
            .rates = objects_.rates(objects_.profile_speed())};
  for (const int direction : {1, -1}) {
    const auto limit = soft_limit(direction);
    if (!limit || (*plan.target - *limit) * direction <= 0) continue;
    plan.target = limit;
    plan.shortened = true;
  }
  return plan;
}

/// Endless, or up to the software limit.
Plan StandardDrive::velocity_plan(std::int64_t velocity) const {
  Plan plan{.activity = Activity::velocity,
            .direction = velocity < 0 ? -1 : 1,
            .rates = objects_.rates(objects_.speed(std::llabs(velocity)))};
  plan.target = soft_limit(plan.direction);
  plan.shortened = plan.target.has_value();
  return plan;
}

/// Rising edge of bit 4: 607Ah and its neighbours as they are now. Bit 5: at once, else after the one before.
void StandardDrive::accept_set_point() {
  if (set_points_.acknowledged() || (control_.halted() && behaviour_.set_point_in_halt_refused)) return;
  constexpr Duration slow = std::chrono::milliseconds(10);
  set_points_.acknowledge(now_ + (behaviour_.acknowledges_late ? slow : Duration{}));
  const auto plan = position_plan();
  motion_.set_last_target(*plan.target);
  if (control_.halted())
    set_points_.suspend(plan);
  else if (motion_.positions() && !control_.at_once() && !behaviour_.set_points_change_at_once)
    set_points_.buffer(plan);
  else
    begin(plan);
}

void StandardDrive::begin(Plan plan) {
  if (plan.target) {
    const auto distance = *plan.target - motor().commanded();
    // At the software limit already, and not away from it.
    if (plan.activity == Activity::velocity && distance * plan.direction <= 0) {
      arrival_.end_at_limit();
      velocity_.hold();
      return;
    }
    plan.direction = distance < 0 ? -1 : 1;
  }
  mode_changed_ = false;
  arrival_.begin(plan.shortened && plan.activity == Activity::position);
  if (plan.rates.cruise <= 0 || limit_active(plan.direction)) {
    velocity_.hold(!behaviour_.velocity_resumes_after_limit);
    return;
  }
  motion_.count_start();
  launch(plan);
}

void StandardDrive::launch(const Plan& plan) {
  motion_.take(plan);
  if (!motion_.reachable(plan)) {
    motor().brake(plan.rates.deceleration);
    motion_.postpone(plan);
  } else if (plan.target && *plan.target == motor().commanded()) {
    on_stopped();  // there already
  } else {
    motion_.go(plan);
  }
}

void StandardDrive::stop_motion(double deceleration) {
  motion_.drop_pending();
  if (homing_.end_pause()) motion_.finish();
  if (!motor().moving()) return;
  motion_.interrupt();
  homing_.interrupt();
  motor().brake(deceleration);
}

/// The current is gone, or there is no distance left to brake.
void StandardDrive::cut() {
  motion_.drop_pending();
  if (homing_.end_pause()) motion_.finish();
  if (!motor().moving()) return;
  motion_.interrupt();
  homing_.interrupt();
  motor().stop(false);
  on_stopped();
}

void StandardDrive::on_stopped() {
  if (const auto plan = motion_.take_pending()) {
    launch(*plan);
    return;
  }
  if (control_.is(PowerState::quick_stop) && objects_.value(0x605A, 2) <= 2)
    control_.enter(PowerState::disabled);
  if (motion_.is(Activity::homing)) {
    act_on(homing_.on_stopped(now_));
    return;
  }
  const bool at_software_limit = motion_.is(Activity::velocity), stopped = motion_.stopping();
  motion_.finish();
  if (stopped) return;
  if (at_software_limit) {
    arrival_.end_at_limit();
    velocity_.hold();
    return;
  }
  arrival_.arrive(now_);
  if (behaviour_.acknowledgement_ends_with_motion) set_points_.end_acknowledgement();
  if (const auto next = set_points_.take_buffered(control_.start())) begin(*next);
}

void StandardDrive::start_homing() {
  if (motor().moving()) return;
  mode_changed_ = false;
  switch (homing_.begin()) {
    case Homing::Begin::unknown:
      break;
    case Homing::Begin::where_it_stands:
      homing_done();
      break;
    case Homing::Begin::search:
      motion_.count_start();
      motion_.take({.activity = Activity::homing});
      act_on(homing_.first_phase());
      break;
  }
}

void StandardDrive::act_on(Homing::Outcome outcome) {
  switch (outcome) {
    case Homing::Outcome::goes_on:
      break;
    case Homing::Outcome::done:
      homing_done();
      break;
    case Homing::Outcome::failed:
      homing_failed();
      break;
    case Homing::Outcome::over:
      motion_.finish();
      break;
  }
}

/// The zero position is home plus 607Ch; the drive does not move there.
void StandardDrive::homing_done() {
  constexpr Duration apart = std::chrono::milliseconds(20);
  motor().set_counter(static_cast<std::int32_t>(-dictionary_.get(0x607C)));
  motion_.set_last_target(motor().commanded());
  homing_.attain(now_ + apart);
  motion_.finish();
}

void StandardDrive::homing_failed() {
  homing_.fail();
  stop_motion(objects_.ramp(0x6085));
  if (!motor().moving()) motion_.finish();
}

/// Profile velocity mode follows 60FFh as long as it is enabled and not halted.
void StandardDrive::follow_velocity() {
  if (!control_.operates() || control_.mode() != 3 || control_.halted()) return;
  const auto wanted = velocity_.held() ? 0 : dictionary_.get(0x60FF);
  if (motion_.is(Activity::velocity)) {
    if (!motion_.stopping() && wanted != velocity_.velocity()) change_velocity(wanted);
  } else if (wanted != 0 && !motor().moving()) {
    velocity_.change_to(wanted);
    begin(velocity_plan(wanted));
  }
}

void StandardDrive::change_velocity(std::int64_t wanted) {
  if (velocity_.change_to(wanted)) {
    stop_motion(objects_.ramp(0x6084));  // and begins anew from standstill, if there is something to run
    return;
  }
  auto plan = velocity_plan(wanted);
  if (!plan.target && plan.rates.cruise < motor().speed()) plan.rates.acceleration = plan.rates.deceleration;
  launch(plan);
}

bool StandardDrive::limit_active(int direction) const {
  return inputs_.active(direction > 0 ? positive_limit : negative_limit);
}

/// At a limit switch the drive brakes and stays energised; what was asked for is over.
void StandardDrive::enforce_limits() {
  if (!motor().moving() || !limit_active(motor().direction())) return;
  if (motion_.is(Activity::homing)) {
    act_on(homing_.at_limit());
    return;
  }
  if (motion_.stopping()) return;
  velocity_.hold(!behaviour_.velocity_resumes_after_limit);
  set_points_.drop_all();
  stop_motion(objects_.ramp(behaviour_.limit_stops_on_ramp ? 0x6084 : 0x6085));
}

}  // namespace axisd::cia402_eds
