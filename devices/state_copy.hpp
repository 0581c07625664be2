// A copy of what the daemon remembers over restarts, as the API takes it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "buses/error.hpp"

namespace axisd {

struct StateCopy {
  std::string text;
  std::uint64_t generation = 0;
};

/// Thread: any.
class StateCopies {
 public:
  virtual ~StateCopies() = default;
  /// Calls back once, from a thread of its own or, with busy (too many ask), at once; not at all if the
  /// daemon ends before. Errors: storage.
  virtual void copy_state(std::function<void(Result<StateCopy>)> callback) = 0;
};

}  // namespace axisd
