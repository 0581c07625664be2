#pragma once

#include <string>

#include "config/configuration.hpp"

namespace axisd::config {

/// Every field as text, one per line: two configurations are equal if their dumps are.
std::string dump(const Configuration& configuration);

}  // namespace axisd::config
