#pragma once

#include <cstdint>

#include "buses/error.hpp"
#include "daemon/store/journal_text.hpp"

namespace axisd::store {

/// Who is told of each save of the state file, so that an older one in its place is recognised. Thread: any.
class StateWitness {
 public:
  virtual ~StateWitness() = default;
  /// Durable when it returns, with all that the journal was told before: waits for the disk. Errors: storage.
  [[nodiscard]] virtual Result<void> note(StateLine line) = 0;
  /// The number of the newest line that is durable.
  [[nodiscard]] virtual std::uint64_t durable_line() const = 0;
  /// Of the newest durable line that says more than what time it is, or what the state file is like.
  [[nodiscard]] virtual std::uint64_t durable_fact() const = 0;
};

}  // namespace axisd::store
