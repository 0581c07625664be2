// What may cost an axis its position without anybody seeing it (M20).
#pragma once

#include <string>
#include <vector>

#include "config/configuration.hpp"

namespace axisd::config {

/// One line each: "axis feeder: a release by X3 (motor_free) that is shorter than its polling at rest (200
/// ms) ...". Precondition: the loader found no error in `configuration`.
std::vector<std::string> position_warnings(const Configuration& configuration);

}  // namespace axisd::config
