#include "buses/ration.hpp"

#include <algorithm>
#include <utility>

namespace axisd {

std::optional<std::uint64_t> Ration::take(std::string_view origin, TimePoint now) {
  auto& period = period_of(origin, now);
  if (now >= period.end) {
    period.end = now + settings_.period;
    period.taken = 0;
  }
  if (period.taken == settings_.most) {
    ++period.left_out;
    return std::nullopt;
  }
  ++period.taken;
  return std::exchange(period.left_out, 0);
}

Ration::Period& Ration::period_of(std::string_view origin, TimePoint now) {
  if (const auto known = periods_.find(origin); known != periods_.end()) return known->second;
  if (periods_.size() >= settings_.origins)
    std::erase_if(periods_,
                  [&](const auto& each) { return each.second.left_out == 0 && now >= each.second.end; });
  const bool told_apart = periods_.size() < settings_.origins;
  return periods_.try_emplace(told_apart ? std::string(origin) : "others", Period{.end = now}).first->second;
}

std::vector<Ration::LeftOut> Ration::take_left_out(TimePoint now) {
  std::vector<LeftOut> told;
  std::erase_if(periods_, [&](const auto& each) {
    const auto& [origin, period] = each;
    if (now < period.end) return false;
    if (period.left_out > 0) told.push_back({.origin = origin, .count = period.left_out});
    return true;
  });
  return told;
}

TimePoint Ration::next_due() const {
  auto next = TimePoint::max();
  for (const auto& [origin, period] : periods_) next = std::min(next, period.end);
  return next;
}

}  // namespace axisd
