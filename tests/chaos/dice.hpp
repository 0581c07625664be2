// Everything random comes from here: one seed, one history.
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "buses/clock.hpp"

namespace axisd::chaos {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  /// 0 .. n-1
  int pick(int n) { return static_cast<int>(random_() % static_cast<std::uint64_t>(n)); }
  template <class T, std::size_t N>
  const T& pick(const std::array<T, N>& choices) {
    return choices.at(static_cast<std::size_t>(pick(static_cast<int>(N))));
  }
  bool chance(double probability) { return static_cast<double>(random_() >> 11U) * 0x1p-53 < probability; }
  Duration up_to(Duration longest) {
    return Duration(static_cast<Duration::rep>(random_() % (longest.count() + 1)));
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace axisd::chaos
