#include "devices/axis/activity.hpp"

namespace axisd {

MoveProfile profile_of(const Plan& plan) {
  return {.target_pulses = static_cast<std::int32_t>(plan.target.value().counter),
          .velocity_rpm = plan.velocity_rpm,
          .start_rpm = plan.start_rpm,
          .acceleration_time = plan.acceleration_time,
          .deceleration_time = plan.deceleration_time};
}

void tell_part(const Activity& activity, Error& cause) {
  if (activity.command->value().state != CommandState::active) return;
  cause.outcome = Outcome::unknown;
  cause.message = "executed in part: " + cause.message;
}

}  // namespace axisd
