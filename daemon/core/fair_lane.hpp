#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>

namespace axisd::core {

/// Which of the things that are kept goes when there is no more room: the oldest of whoever has most of them,
/// so that nobody pushes out what is another's (M32). Keeps sequence numbers only. Pure.
class FairLane {
 public:
  /// At least 1.
  explicit FairLane(std::size_t capacity) : capacity_(capacity) {}

  /// Enters `sequence`, which is above all before it. What has to go for it; 0: nothing.
  std::uint64_t add(const std::string& owner, std::uint64_t sequence);
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  std::size_t capacity_, size_ = 0;
  std::map<std::string, std::deque<std::uint64_t>> by_owner_;
};

}  // namespace axisd::core
