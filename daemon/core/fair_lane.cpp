#include "daemon/core/fair_lane.hpp"

#include <algorithm>

namespace axisd::core {

std::uint64_t FairLane::add(const std::string& owner, std::uint64_t sequence) {
  std::uint64_t gone = 0;
  if (size_ == capacity_) {
    const auto most = std::ranges::max_element(by_owner_, {}, [](const auto& each) {
      // Of equals whoever has the oldest.
      return std::pair(each.second.size(), ~each.second.front());
    });
    gone = most->second.front();
    most->second.pop_front();
    if (most->second.empty()) by_owner_.erase(most);
    --size_;
  }
  by_owner_[owner].push_back(sequence);
  ++size_;
  return gone;
}

}  // namespace axisd::core
