#include "buses/latency_histogram.hpp"

#include <algorithm>

namespace axisd {
namespace {

constexpr std::int64_t first_bound_ns = 100'000;
/// 2^(i/4)
constexpr std::array<double, 4> steps = {1, 1.189207115, 1.414213562, 1.681792831};

constexpr auto bounds = [] {
  std::array<Duration, LatencyHistogram::bucket_count> all{};
  for (std::size_t i = 0; i + 1 < all.size(); ++i)
    all.at(i) = Duration(static_cast<std::int64_t>(static_cast<double>(first_bound_ns << (i / steps.size())) *
                                                   steps.at(i % steps.size())));
  all.back() = Duration::max();
  return all;
}();

}  // namespace

Duration LatencyHistogram::bound(std::size_t bucket) { return bounds.at(bucket); }

void LatencyHistogram::add(Duration latency) {
  const auto bucket = std::ranges::lower_bound(bounds, latency);
  ++counts_.at(static_cast<std::size_t>(bucket - bounds.begin()));
  longest_ = std::max(longest_, latency);
  sum_ += latency;
}

}  // namespace axisd
