// Which of the files that a configuration names the text of a client may have read.
#pragma once

#include <set>
#include <string>

#include "config/configuration.hpp"
#include "config/reader.hpp"

namespace axisd::config {

/// Reports each that is neither below the folder of the configuration's own file nor one of `others`, and
/// marks its key as unusable, so that nobody reads it.
void check_named_files(const Configuration& configuration, const std::set<std::string>& others,
                       Diagnostics& diagnostics, Places& places);

}  // namespace axisd::config
