#include "devices/simulation/motion.hpp"

#include <cstdlib>

namespace axisd::simulation {

Plan aimed(Plan plan, const Motor& motor) {
  if (plan.target) plan.direction = *plan.target < motor.commanded() ? -1 : 1;
  return plan;
}

void Motion::take(const Plan& plan) {
  activity_ = last_activity_ = plan.activity;
  stopping_ = false;
  pending_.reset();
  if (plan.activity == Activity::position && plan.target) last_target_ = *plan.target;
}

bool Motion::reachable(const Plan& plan) const {
  if (!motor_->moving()) return true;
  if (plan.direction != motor_->direction()) return false;
  const auto distance = plan.target.value_or(0) - motor_->commanded();
  return !plan.target || static_cast<double>(std::llabs(distance)) >= motor_->stopping_distance(plan.rates);
}

void Motion::go(const Plan& plan) {
  if (plan.target)
    motor_->move(*plan.target - motor_->commanded(), plan.rates);
  else
    motor_->run(plan.direction, plan.rates);
}

void Motion::launch(const Plan& plan) {
  take(plan);
  if (reachable(plan)) {
    go(plan);
    return;
  }
  motor_->brake();
  postpone(plan);
}

std::optional<Plan> Motion::take_pending() {
  if (!pending_) return std::nullopt;
  return aimed(*std::exchange(pending_, std::nullopt), *motor_);
}

}  // namespace axisd::simulation
