// Roles that lock everybody out.
#pragma once

#include <string>
#include <vector>

#include "config/configuration.hpp"

namespace axisd::config {

/// A line where nobody can do what somebody has to be able to do: "access: nobody has a role: ...".
std::vector<std::string> access_warnings(const Configuration& configuration);

}  // namespace axisd::config
