#pragma once

#include <string>

#include "buses/clock.hpp"

namespace axisd::tls {

/// "2026-11-24T10:00:00Z".
[[nodiscard]] std::string to_text(WallTime time);

}  // namespace axisd::tls
