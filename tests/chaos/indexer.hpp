// Axes that index under faults.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "tests/chaos/judge.hpp"
#include "tests/chaos/plant.hpp"

namespace axisd::chaos {

/// Gives each axis its next short move as soon as the last one is done; where it cannot move, what lets it
/// move; where that is refused or was in vain, again 20 ms later. What is accepted the judge gets to see.
class Indexer {
 public:
  Indexer(Plant& plant, Judge& judge, std::uint64_t seed);
  Indexer(const Indexer&) = delete;

 private:
  void later(std::size_t index, Duration pause);
  void next(std::size_t index);
  [[nodiscard]] Action action(const Station& station);

  Plant* plant_;
  Judge* judge_;
  Dice dice_;
  std::vector<Clock::Timer> next_;  ///< of each station
  std::shared_ptr<int> alive_ = std::make_shared<int>();
};

}  // namespace axisd::chaos
