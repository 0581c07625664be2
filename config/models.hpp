// What the command line asks of models.
#pragma once

#include <string_view>

namespace axisd::config {

/// A file of the machine builder describes each drive of this model; false: its folder does, or there is no
/// such model.
bool is_described_by_file(std::string_view model);

}  // namespace axisd::config
