// Drives of which there is nothing but their makers' data sheets.
#pragma once

#include <filesystem>
#include <vector>

#include "tests/conformance/manual.hpp"

namespace axisd::conformance {

/// What such a drive can do, by what its file has and says: the abilities of model cia402, less what the file
/// lacks. The scenarios that it has nothing for are skipped, each with the reason; never by the file's name.
/// Throws std::runtime_error: it cannot be read.
Manual manual_of_sheet(const std::filesystem::path& file);

/// Those that `model: cia402` takes (tests/support/makers_files.hpp), there or not.
std::vector<std::filesystem::path> data_sheets();

}  // namespace axisd::conformance
