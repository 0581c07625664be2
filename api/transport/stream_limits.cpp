#include "api/transport/stream_limits.hpp"

#include <algorithm>
#include <functional>
#include <utility>

namespace axisd::transport {

std::vector<std::uint64_t> beyond(const StreamLimits& limits,
                                  const std::map<std::uint64_t, OpenStreams>& connections) {
  std::vector<std::uint64_t> cut;
  std::vector<std::pair<std::int64_t, std::uint64_t>> others;  // how many idle ones, and whose
  std::int64_t idle = 0;
  for (const auto& [id, streams] : connections) {
    if (streams.open > limits.of_one) {
      cut.push_back(id);
    } else if (streams.lasting() > 0) {
      others.emplace_back(streams.lasting(), id);
      idle += streams.lasting();
    }
  }
  std::ranges::sort(others, std::greater{});
  for (const auto& [many, id] : others) {
    if (idle <= limits.idle) break;
    cut.push_back(id);
    idle -= many;
  }
  return cut;
}

}  // namespace axisd::transport
