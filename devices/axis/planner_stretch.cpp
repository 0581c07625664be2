// Slower profiles, so that several axes arrive together.
#include <algorithm>
#include <cmath>
#include <utility>

#include "buses/seconds.hpp"
#include "devices/axis/planner.hpp"

namespace axisd {

namespace {

Duration distance_in_time(Duration one, Duration other) { return one > other ? one - other : other - one; }

}  // namespace

bool Planner::reaches_speed(const Plan& plan, std::int64_t pulses) const {
  const auto per_rpm = static_cast<double>(settings_->scale.pulses_per_revolution) / 60.0;
  const auto way_of = [&](double rpm, const Ramps& ramps) {
    return (plan.start_rpm + rpm) * per_rpm / 2 *
           (in_seconds(ramps.acceleration) + in_seconds(ramps.deceleration));
  };
  const Ramps told{.acceleration = plan.acceleration_time, .deceleration = plan.deceleration_time};
  const auto longest =
      std::max(way_of(plan.velocity_rpm, told), way_of(sent_rpm(plan.velocity_rpm), sent_ramps(plan)));
  return longest <= static_cast<double>(std::abs(pulses));
}

Plan Planner::at_speed(Plan plan, int rpm) const {
  plan.velocity_rpm = rpm;
  plan.start_rpm = std::clamp(std::min(settings_->limits.start_speed_rpm, rpm),
                              capabilities_->minimum_start_rpm, capabilities_->maximum_start_rpm);
  return granting(std::move(plan));
}

/// Whole r/min are coarse at low speeds; longer ramps fill what is left.
Plan Planner::lengthened(Plan plan, std::int64_t pulses, Duration wanted) const {
  const auto missing = in_seconds(wanted - duration(plan, pulses));
  const auto speed_won = plan.velocity_rpm - plan.start_rpm;
  if (missing <= 0 || speed_won <= 0) return plan;
  // A ramp runs at the mean of both speeds in place of the full one.
  const auto longer = milliseconds(std::lround(missing * 2 * plan.velocity_rpm / speed_won * 1000));
  const auto longest = milliseconds(capabilities_->maximum_time_ms);
  auto candidate = plan;
  const bool brakes_as_told = capabilities_->fixed_deceleration == 0;
  candidate.acceleration_time =
      std::min<Duration>(plan.acceleration_time + (brakes_as_told ? longer / 2 : longer), longest);
  const auto rest =
      longer - std::chrono::duration_cast<milliseconds>(candidate.acceleration_time - plan.acceleration_time);
  candidate.deceleration_time = capabilities_->own_deceleration
                                    ? std::min<Duration>(plan.deceleration_time + rest, longest)
                                    : candidate.acceleration_time;
  candidate = granting(std::move(candidate));
  return reaches_speed(candidate, pulses) ? candidate : plan;
}

Plan Planner::stretched(Plan plan, std::int64_t pulses, Duration wanted) const {
  if (pulses == 0) return plan;
  const int lowest =
      std::min(plan.velocity_rpm, std::max(capabilities_->minimum_rpm, capabilities_->minimum_start_rpm));
  const auto fits = [&](int rpm) {
    const auto slower = at_speed(plan, rpm);
    return !reaches_speed(slower, pulses) || duration(slower, pulses) <= wanted;
  };
  // The lowest speed that is not too late, and the one below it.
  int low = lowest, high = plan.velocity_rpm;
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (fits(middle))
      high = middle;
    else
      low = middle + 1;
  }
  while (low > lowest && !reaches_speed(at_speed(plan, low), pulses)) --low;
  auto best = lengthened(at_speed(plan, low), pulses, wanted);
  for (const int rpm : {low - 1, low + 1}) {
    if (rpm < lowest || rpm > plan.velocity_rpm) continue;
    auto other = lengthened(at_speed(plan, rpm), pulses, wanted);
    const bool nearer =
        distance_in_time(duration(other, pulses), wanted) < distance_in_time(duration(best, pulses), wanted);
    if (nearer && reaches_speed(other, pulses)) best = std::move(other);
  }
  best.predicted = duration(best, pulses);
  return best;
}

}  // namespace axisd
