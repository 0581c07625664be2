#include "devices/simulation/mechanics.hpp"

#include <cmath>

namespace axisd::simulation {
namespace {

/// Calls `use(from, to)` for the home switch, on a rotary load for each of its places around the shaft.
template <class Use>
void for_each_home_switch(const Mechanics& mechanics, std::int64_t shaft, Use use) {
  if (!mechanics.home_switch_from || !mechanics.home_switch_to) return;
  const auto from = *mechanics.home_switch_from;
  const auto to = *mechanics.home_switch_to;
  if (!mechanics.turn) return use(from, to);
  // Each turn is rounded by itself: no error adds up.
  const auto turn = std::floor(static_cast<double>(shaft - from) / *mechanics.turn);
  for (const int neighbour : {-1, 0, 1, 2}) {
    const auto shift = std::llround((turn + neighbour) * *mechanics.turn);
    use(from + shift, to + shift);
  }
}

}  // namespace

bool switch_active(const Mechanics& mechanics, SwitchKind kind, std::int64_t shaft) {
  const auto& m = mechanics;
  if (kind == SwitchKind::home) {
    bool active = false;
    for_each_home_switch(m, shaft, [&](std::int64_t from, std::int64_t to) {
      active = active || (shaft >= from && shaft <= to);
    });
    return active;
  }
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
  for_each_home_switch(m, shaft, [&](std::int64_t from, std::int64_t to) {
    consider(from, 0);
    consider(to, 1);
  });
  consider(m.positive_limit_from, 0);
  consider(m.negative_limit_from, 1);
  return nearest;
}

}  // namespace axisd::simulation
