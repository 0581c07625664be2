#include "devices/group/arrival.hpp"

#include <algorithm>

namespace axisd {

void arrive_together(std::vector<Arrival>& arrivals) {
  // First as fast as can be predicted: what is too short for its velocity gets the one that it reaches.
  Duration longest{};
  for (auto& arrival : arrivals) {
    if (arrival.pulses == 0) continue;
    arrival.plan = arrival.planner->stretched(arrival.plan, arrival.pulses, Duration{});
    longest = std::max(longest, arrival.plan.predicted);
  }
  for (auto& arrival : arrivals)
    if (arrival.pulses != 0) arrival.plan = arrival.planner->stretched(arrival.plan, arrival.pulses, longest);
}

Duration arrival_error(const std::vector<Duration>& durations) {
  std::vector<Duration> moving;
  std::ranges::copy_if(durations, std::back_inserter(moving), [](Duration d) { return d > Duration{}; });
  if (moving.empty()) return {};
  const auto [least, most] = std::ranges::minmax(moving);
  return most - least;
}

}  // namespace axisd
