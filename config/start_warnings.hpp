// Starts that slow SDO servers do not permit (M6, M31).
#pragma once

#include <string>
#include <vector>

#include "config/configuration.hpp"

namespace axisd::config {

/// One line each: "axis feeder: a start is proven by 1 SDO answer within reboot_guard (50 ms), and takes
/// ...". Precondition: the loader found no error in `configuration`.
std::vector<std::string> start_warnings(const Configuration& configuration);

}  // namespace axisd::config
