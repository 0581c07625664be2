#include "devices/simulation/shaft.hpp"

#include <cstdlib>

namespace axisd::simulation {

void Shaft::follow(TimePoint now, const Hold& hold, Duration following) {
  motor_.follow_within(following);
  if (!hold.in_control) encoder_.relax();
  const bool held = motor_.blocked() || motor_.moving() || hold.energised;
  if (const auto pulses = encoder_.slipped(now, !held); pulses != 0) motor_.push(pulses, hold.seen);
}

bool Shaft::push(std::int64_t pulses, const Hold& hold) {
  if (motor_.blocked() || hold.energised) return false;
  motor_.push(pulses, hold.seen);
  return true;
}

bool Shaft::within(std::int64_t pulses, TimePoint now) const {
  return std::llabs(encoder_.deviation(motor_, now)) <= pulses;
}

}  // namespace axisd::simulation
