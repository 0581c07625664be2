// What is wrong in files that a configuration names, and does not matter to it.
#pragma once

#include <string>
#include <vector>

#include "config/configuration.hpp"

namespace axisd::config {

/// One line each, of a file that several axes name once: "drive.eds:71: highlimit=65536: ...". Precondition:
/// the loader found no error in `configuration`.
std::vector<std::string> file_warnings(const Configuration& configuration);

}  // namespace axisd::config
