#pragma once

#include <chrono>

#include "buses/ration.hpp"

/// How many records each identity may cause in a minute by what needs no role, so that nobody writes the
/// others out of files of a bounded size (M32).
namespace axisd::audit_ration {

inline constexpr Ration::Settings refusals{.most = 60, .period = std::chrono::minutes(1), .origins = 1'000};
inline constexpr Ration::Settings stops{.most = 1'000, .period = std::chrono::minutes(1), .origins = 1'000};

}  // namespace axisd::audit_ration
