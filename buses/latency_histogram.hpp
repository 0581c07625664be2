#pragma once

#include <array>
#include <cstdint>

#include "buses/clock.hpp"

namespace axisd {

/// How often something took how long, in buckets of fixed bounds: bucket i holds what took more than
/// bound(i - 1) and at most bound(i); each bound is 2^(1/4) times the one before it, so that a percentile
/// read from it is at most 19 % too high. Pure; adding allocates nothing.
class LatencyHistogram {
 public:
  static constexpr std::size_t bucket_count = 70;
  /// 0.1 ms * 2^(bucket / 4), up to 13.1 s; the last bucket has none (Duration::max()).
  static Duration bound(std::size_t bucket);

  void add(Duration latency);
  [[nodiscard]] const std::array<std::uint64_t, bucket_count>& counts() const { return counts_; }
  [[nodiscard]] Duration longest() const { return longest_; }
  /// Of all together.
  [[nodiscard]] Duration sum() const { return sum_; }

 private:
  std::array<std::uint64_t, bucket_count> counts_{};
  Duration longest_{}, sum_{};
};

}  // namespace axisd
