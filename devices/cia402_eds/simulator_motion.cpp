// Starts and stops of the simulated standard drive: profile position and profile velocity mode.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "devices/cia402_eds/simulator.hpp"

namespace axisd::cia402_eds {

std::int64_t StandardDrive::value(std::uint16_t index, std::int64_t without) const {
  return dictionary_.find(index, 0) == nullptr ? without : dictionary_.get(index);
}

/// Counts of the motor per second.
double StandardDrive::speed(std::int64_t velocity) const {
  return static_cast<double>(velocity) * (units_.velocity / units_.position);
}

/// 6081h, within 607Fh where that is anything.
double StandardDrive::profile_speed() const {
  const auto most = dictionary_.get(0x607F), wanted = dictionary_.get(0x6081);
  return speed(most > 0 ? std::min(wanted, most) : wanted);
}

/// Counts of the motor per second squared; 0 in the object is at once. What a drive lacks has 6083h instead,
/// and 6085h first 6084h.
double StandardDrive::ramp(std::uint16_t index) const {
  constexpr double at_once = 1e12, usual = 10;  // of its own: revolutions per second squared
  while (dictionary_.find(index, 0) == nullptr) {
    if (index == 0x6083) return usual / units_.position;
    index = index == 0x6085 ? 0x6084 : 0x6083;
  }
  const auto set = dictionary_.get(index);
  return set > 0 ? static_cast<double>(set) * (units_.acceleration / units_.position) : at_once;
}

simulation::Rates StandardDrive::rates(double cruise) const {
  return {.cruise = cruise, .acceleration = ramp(0x6083), .deceleration = ramp(0x6084)};
}

/// 607Dh in the motor's numbers; nothing: the end of the range is no limit, and a range without room is none.
std::optional<std::int64_t> StandardDrive::soft_limit(int direction) const {
  if (dictionary_.get(0x607D, 1) >= dictionary_.get(0x607D, 2)) return std::nullopt;
  const auto limit = dictionary_.get(0x607D, direction > 0 ? 2 : 1);
  const std::int64_t end =
      direction > 0 ? std::numeric_limits<std::int32_t>::max() : std::numeric_limits<std::int32_t>::min();
  if (limit == end) return std::nullopt;
  return motor_.commanded() - motor_.counter() + limit;
}

/// A relative set-point counts from the target before it.
StandardDrive::Plan StandardDrive::position_plan() const {
  const bool relative = (control_ & 0x40U) != 0;
  const auto base = relative ? last_target_ : motor_.commanded() - motor_.counter();
  Plan plan{.activity = Activity::position,
            .target = base + dictionary_.get(0x607A),
            .rates = rates(profile_speed())};
  for (const int direction : {1, -1}) {
    const auto limit = soft_limit(direction);
    if (!limit || (*plan.target - *limit) * direction <= 0) continue;
    plan.target = limit;
    plan.shortened = true;
  }
  return plan;
}

/// Endless, or up to the software limit.
StandardDrive::Plan StandardDrive::velocity_plan(std::int64_t velocity) const {
  Plan plan{.activity = Activity::velocity,
            .direction = velocity < 0 ? -1 : 1,
            .rates = rates(speed(std::llabs(velocity)))};
  plan.target = soft_limit(plan.direction);
  plan.shortened = plan.target.has_value();
  return plan;
}

/// Rising edge of bit 4: 607Ah and its neighbours as they are now. Bit 5: at once, else after the one before.
void StandardDrive::accept_set_point() {
  if (acknowledged_ || (halted() && behaviour_.set_point_in_halt_refused)) return;
  constexpr Duration slow = std::chrono::milliseconds(10);
  acknowledged_ = true;
  acknowledgement_due_ = now_ + (behaviour_.acknowledges_late ? slow : Duration{});
  const auto plan = position_plan();
  last_target_ = *plan.target;
  const bool under_way = activity_ == Activity::position && motor_.moving() && !stopping_;
  if (halted())
    suspended_ = plan;
  else if (under_way && (control_ & 0x20U) == 0 && !behaviour_.set_points_change_at_once)
    buffered_ = plan;
  else
    begin(plan);
}

void StandardDrive::begin(Plan plan) {
  if (plan.target) {
    const auto distance = *plan.target - motor_.commanded();
    // At the software limit already, and not away from it.
    if (plan.activity == Activity::velocity && distance * plan.direction <= 0) {
      limited_ = velocity_held_ = true;
      return;
    }
    plan.direction = distance < 0 ? -1 : 1;
  }
  reached_ = mode_changed_ = false;
  limited_ = plan.shortened && plan.activity == Activity::position;
  if (plan.rates.cruise <= 0 || limit_active(plan.direction)) {
    velocity_held_ = !behaviour_.velocity_resumes_after_limit;
    return;
  }
  ++starts_;
  launch(plan);
}

void StandardDrive::launch(const Plan& plan) {
  activity_ = plan.activity;
  stopping_ = false;
  pending_.reset();
  const auto distance = plan.target.value_or(0) - motor_.commanded();
  if (plan.activity == Activity::position) last_target_ = *plan.target;
  const bool turns = motor_.moving() && plan.direction != motor_.direction();
  const bool too_near = motor_.moving() && plan.target &&
                        static_cast<double>(std::llabs(distance)) < motor_.stopping_distance(plan.rates);
  if (turns || too_near) {
    motor_.brake(plan.rates.deceleration);
    pending_ = plan;
  } else if (!plan.target) {
    motor_.run(plan.direction, plan.rates);
  } else if (distance != 0) {
    motor_.move(distance, plan.rates);
  } else {
    on_stopped();  // there already
  }
}

void StandardDrive::stop_motion(double deceleration) {
  pending_.reset();
  end_pause();
  if (!motor_.moving()) return;
  stopping_ = true;
  phase_ = Phase::ending;
  motor_.brake(deceleration);
}

/// The current is gone, or there is no distance left to brake.
void StandardDrive::cut() {
  pending_.reset();
  end_pause();
  if (!motor_.moving()) return;
  stopping_ = true;
  phase_ = Phase::ending;
  motor_.stop(false);
  on_stopped();
}

void StandardDrive::on_stopped() {
  if (pending_) {
    auto plan = *pending_;
    // The braking may have carried it past the target.
    if (plan.target) plan.direction = *plan.target < motor_.commanded() ? -1 : 1;
    launch(plan);
    return;
  }
  if (state_ == State::quick_stop && value(0x605A, 2) <= 2) state_ = State::disabled;
  if (activity_ == Activity::homing) {
    homing_stopped();
    return;
  }
  const auto ended = std::exchange(activity_, Activity::none);
  if (std::exchange(stopping_, false)) return;
  if (ended == Activity::velocity) {  // at the software limit
    limited_ = velocity_held_ = true;
    return;
  }
  reached_ = !limited_;
  watch_window();
  if (behaviour_.acknowledgement_ends_with_motion) acknowledged_ = false;
  if (auto next = std::exchange(buffered_, std::nullopt)) {
    if ((control_ & 0x10U) == 0) acknowledged_ = false;
    begin(*next);
  }
}

/// Profile velocity mode follows 60FFh as long as it is enabled and not halted.
void StandardDrive::follow_velocity() {
  if (state_ != State::operation || mode_ != 3 || halted()) return;
  const auto wanted = velocity_held_ ? 0 : dictionary_.get(0x60FF);
  if (activity_ == Activity::velocity) {
    if (!stopping_ && wanted != velocity_) change_velocity(wanted);
  } else if (wanted != 0 && !motor_.moving()) {
    velocity_ = wanted;
    begin(velocity_plan(wanted));
  }
}

void StandardDrive::change_velocity(std::int64_t wanted) {
  const bool turns = wanted == 0 || (wanted < 0) != (velocity_ < 0);
  velocity_ = wanted;
  if (turns) {
    stop_motion(ramp(0x6084));  // and begins anew from standstill, if there is something to run
    return;
  }
  auto plan = velocity_plan(wanted);
  if (!plan.target && plan.rates.cruise < motor_.speed()) plan.rates.acceleration = plan.rates.deceleration;
  launch(plan);
}

bool StandardDrive::limit_active(int direction) const {
  return inputs_.active(direction > 0 ? positive_limit : negative_limit);
}

/// At a limit switch the drive brakes and stays energised; what was asked for is over.
void StandardDrive::enforce_limits() {
  if (!motor_.moving() || !limit_active(motor_.direction())) return;
  if (activity_ == Activity::homing) {
    homing_limit();
    return;
  }
  if (stopping_) return;
  velocity_held_ = !behaviour_.velocity_resumes_after_limit;
  suspended_.reset();
  buffered_.reset();
  stop_motion(ramp(behaviour_.limit_stops_on_ramp ? 0x6084 : 0x6085));
}

}  // namespace axisd::cia402_eds
