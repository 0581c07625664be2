#pragma once

#include <chrono>

#include "buses/clock.hpp"

namespace axisd {

/// As a number, to calculate with and for people to read.
[[nodiscard]] constexpr double in_seconds(Duration time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace axisd
