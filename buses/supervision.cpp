#include "buses/supervision.hpp"

#include <algorithm>

namespace axisd {

namespace {

constexpr Duration longest_period = std::chrono::seconds(1);
constexpr Duration unwatched_stall = std::chrono::seconds(3);
/// A server under siege answers late, which costs nobody a stop.
constexpr Duration doors_patience = std::chrono::seconds(8);

}  // namespace

Supervision::Supervision(Duration interval)
    : period_(interval > Duration::zero() ? std::min(interval / 4, longest_period) : longest_period),
      stalled_after_(interval > Duration::zero() ? interval * 3 / 4 : unwatched_stall),
      last_look_(TimePoint::min()) {}

TimePoint Supervision::doors_owe_since(TimePoint now) const { return now - doors_patience; }

Supervision::Finding Supervision::look(TimePoint now, const std::vector<Part>& parts, bool doors_answer) {
  const bool first = last_look_ == TimePoint::min();
  const bool held_up = !first && now - last_look_ > 2 * period_;
  last_look_ = now;
  Finding finding{.next = period_};
  for (const auto& part : parts)
    if (part.last <= now - stalled_after_) finding.dead.push_back(part.name);
  if (!finding.dead.empty() && held_up) {
    finding.dead.clear();
    finding.sign = Sign::unsure;
    finding.next = period_ / 4;
  } else if (!finding.dead.empty()) {
    finding.sign = Sign::dead;
  } else if (!doors_answer) {
    finding.sign = Sign::silent;
  }
  return finding;
}

}  // namespace axisd
