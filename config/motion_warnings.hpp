// Where an axis moves or brakes otherwise than its limits let expect.
#pragma once

#include <string>
#include <vector>

#include "config/configuration.hpp"

namespace axisd::config {

/// One line each: "axis feeder: jog_travel 10000 mm is more than the range of limits.position ...".
/// Precondition: the loader found no error in `configuration`.
std::vector<std::string> motion_warnings(const Configuration& configuration);

}  // namespace axisd::config
