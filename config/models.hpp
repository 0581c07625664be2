// What the command line asks of models.
#pragma once

#include <string_view>

#include "devices/axis/settings.hpp"

namespace axisd::config {

/// A file of the machine builder describes each drive of this model; false: its folder does, or there is no
/// such model.
bool is_described_by_file(std::string_view model);

/// Starts of this axis may go in one frame (drive.start_in_one_frame): its model has the key, and no terminal
/// may move the motor between its parameters and the trigger.
bool may_start_in_one_frame(const AxisSettings& axis);

}  // namespace axisd::config
