#include "devices/simulation/mechanics.hpp"

namespace axisd::simulation {

bool switch_active(const Mechanics& mechanics, SwitchKind kind, std::int64_t shaft) {
  const auto& m = mechanics;
  if (kind == SwitchKind::home)
    return m.home_switch_from && m.home_switch_to && shaft >= *m.home_switch_from &&
           shaft <= *m.home_switch_to;
  if (kind == SwitchKind::positive_limit) return m.positive_limit_from && shaft >= *m.positive_limit_from;
  return m.negative_limit_from && shaft <= *m.negative_limit_from;
}

std::optional<std::int64_t> next_switch(const Mechanics& mechanics, std::int64_t shaft, int direction) {
  const auto& m = mechanics;
  std::optional<std::int64_t> nearest;
  // `first` is the first position of the other state when going forwards; backwards it is the one before.
  const auto consider = [&](std::optional<std::int64_t> first, std::int64_t further) {
    if (!first) return;
    const auto at = *first + further - (direction > 0 ? 0 : 1);
    if ((at - shaft) * direction <= 0) return;
    if (!nearest || (at - *nearest) * direction < 0) nearest = at;
  };
  consider(m.home_switch_from, 0);
  consider(m.home_switch_to, 1);
  consider(m.positive_limit_from, 0);
  consider(m.negative_limit_from, 1);
  return nearest;
}

}  // namespace axisd::simulation
