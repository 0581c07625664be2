#include "buses/line_limit.hpp"

#include <algorithm>
#include <utility>

namespace axisd {

bool LineLimit::admit(const std::string& origin, TimePoint now) {
  auto found = periods_.find(origin);
  if (found == periods_.end()) {
    const bool told_apart = periods_.size() < settings_.origins;
    found = periods_.try_emplace(told_apart ? origin : "others", Period{.end = now + settings_.period}).first;
  }
  auto& period = found->second;
  if (now >= period.end) {
    if (period.lines > settings_.most) {
      const auto known = std::ranges::find(over_, found->first, &LeftOut::origin);
      auto& left_out = known != over_.end() ? *known : over_.emplace_back(LeftOut{.origin = found->first});
      left_out.lines += period.lines - settings_.most;
    }
    period = {.end = now + settings_.period};
  }
  return ++period.lines <= settings_.most;
}

std::vector<LineLimit::LeftOut> LineLimit::take_left_out(TimePoint now) {
  auto told = std::exchange(over_, {});
  std::erase_if(periods_, [&](const auto& each) {
    const auto& [origin, period] = each;
    if (now < period.end) return false;
    if (period.lines > settings_.most)
      told.push_back({.origin = origin, .lines = period.lines - settings_.most});
    return true;
  });
  return told;
}

TimePoint LineLimit::next_due() const {
  auto next = over_.empty() ? TimePoint::max() : TimePoint{};
  for (const auto& [origin, period] : periods_) next = std::min(next, period.end);
  return next;
}

}  // namespace axisd
