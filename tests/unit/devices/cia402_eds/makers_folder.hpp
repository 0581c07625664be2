// Makers' data sheets, which are not part of this project.
#pragma once

#include <cstdlib>
#include <filesystem>

#include "tests/support/source_tree.hpp"

namespace axisd::cia402_eds {

/// The folder that AXISD_EDS_FOLDER names, else ../shared/eds beside the source tree.
inline std::filesystem::path makers_folder() {
  const char* named = std::getenv("AXISD_EDS_FOLDER");
  return named != nullptr ? std::filesystem::path(named)
                          : std::filesystem::path(test::in_source_tree("../shared/eds"));
}

}  // namespace axisd::cia402_eds
