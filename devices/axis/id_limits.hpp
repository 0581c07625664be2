#pragma once

#include <algorithm>
#include <cstddef>

namespace axisd {

/// How many request ids are remembered, and whose (M32). A client may have twice as many as are free: alone
/// two thirds of all, beside another that has as many as it may two fifths. So there is always room for one
/// more client, however many there are. What is remembered is not forgotten for somebody else's sake, so that
/// each of them may always have `guaranteed()` as well, from a reserve.
struct IdLimits {
  /// 480 axes that index twice a second, by one client, for `remembered_at_least` and a minute.
  std::size_t total = std::size_t{1} << 20U;

  [[nodiscard]] constexpr std::size_t guaranteed() const {
    return std::clamp<std::size_t>(total / 100, 1, 1'000);
  }
  [[nodiscard]] constexpr std::size_t reserve() const { return total / 10; }
  /// What a client may have while there are so many ids of others.
  [[nodiscard]] constexpr std::size_t share(std::size_t of_others) const {
    // own <= 2 x (total - own - others)
    const auto share = of_others < total ? 2 * (total - of_others) / 3 : 0;
    const auto room = total + reserve() - std::min(of_others, total + reserve());
    return std::max(share, std::min(guaranteed(), room));
  }
};
static_assert(IdLimits{}.share(0) >= std::size_t{480} * 2 * 60 * 12);

}  // namespace axisd
