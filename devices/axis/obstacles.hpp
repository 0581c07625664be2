// What stands in the way of a request: all of it, in the order in which it is looked at. A refusal is the
// first that blocks, an explanation is the whole list.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "buses/error.hpp"

namespace axisd {

/// One precondition that does not hold, or something that is worth knowing before the request is made.
struct Obstacle {
  Error error;           ///< what, and what to do about it
  bool blocking = true;  ///< refuses the request; else it delays it, ends something else, or may end it later
};

class Obstacles {
 public:
  void block(Error error) { all_.push_back({.error = std::move(error)}); }
  void note(Error error) { all_.push_back({.error = std::move(error), .blocking = false}); }
  template <class T>
  void block_on(const Result<T>& result) {
    if (!result) block(result.error());
  }

  [[nodiscard]] bool blocked() const { return std::ranges::any_of(all_, &Obstacle::blocking); }
  /// The first that blocks.
  [[nodiscard]] Result<void> verdict() const {
    const auto first = std::ranges::find_if(all_, &Obstacle::blocking);
    if (first == all_.end()) return {};
    return fail(first->error);
  }
  [[nodiscard]] std::vector<Obstacle> all() && { return std::move(all_); }

 private:
  std::vector<Obstacle> all_;
};

}  // namespace axisd
