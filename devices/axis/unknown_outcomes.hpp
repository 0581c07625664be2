#pragma once

#include <cstdint>

namespace axisd {

/// Starts whose frame got no reply, by what reading the drive back showed (M8).
struct UnknownOutcomes {
  std::uint64_t executed = 0;
  std::uint64_t not_executed = 0;
  std::uint64_t unresolved = 0;  ///< the drive could not be asked, or was stopped meanwhile
};

}  // namespace axisd
