// Data sheets as their makers ship them. Few licences permit a copy: those lie in tests/data/eds, the others
// are read from a folder that is not part of this project.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string_view>

#include "tests/support/source_tree.hpp"

namespace axisd::test {

/// The folder that AXISD_EDS_FOLDER names, else ../shared/eds beside the source tree.
inline std::filesystem::path makers_folder() {
  const char* named = std::getenv("AXISD_EDS_FOLDER");
  return named != nullptr ? std::filesystem::path(named)
                          : std::filesystem::path(in_source_tree("../shared/eds"));
}

/// The file of this name: the one of the project, else that of the makers' folder, where it may be missing.
inline std::filesystem::path makers_file(std::string_view name) {
  auto own = std::filesystem::path(in_source_tree("tests/data/eds")) / name;
  return std::filesystem::exists(own) ? own : makers_folder() / name;
}

/// Those that `model: cia402` takes (tests/unit/devices/cia402_eds/makers_files_test.cpp has the others, and
/// why).
inline constexpr std::string_view accepted_makers_files[] = {
    "cia-402-profile.eds",
    "elmo-gold-whistle-v002.dcf",
    "elmo-simpliq.dcf",
    "elmo.eds",
    "eyou-yiyou-servo-1.4.eds",
    "faulhaber-327-3150-1.eds",
    "faulhaber-605-3150-67-b.eds",
    "maxon-epos-70-10.eds",
    "maxon-epos4.eds",
    "nanotec-cl4-e-1-12.eds",
    "oriental-motor-blvd-krd-v400.eds",
    "pilz-prbt-0-1.dcf",
    "ros2-canopen-fake-slave.eds",
    "ros2-canopen-robot-control.eds",
    "schunk-prl120.eds",
    "technosoft-isd860.eds",
    "trinamic-tmcc-160.eds",
    "trinamic-tmcm-1231.eds",
    "trinamic-tmcm-1270.eds",
    "trinamic-tmcm-1636.eds",
};

}  // namespace axisd::test
