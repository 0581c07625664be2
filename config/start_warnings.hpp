// Starts that slow SDO servers do not permit (M6, M31).
#pragma once

#include <string>
#include <vector>

#include "config/configuration.hpp"

namespace axisd::config {

/// One line each: "axis feeder: a start needs an SDO answer within reboot_guard (100 ms) ...". Precondition:
/// the loader found no error in `configuration`.
std::vector<std::string> start_warnings(const Configuration& configuration);

}  // namespace axisd::config
