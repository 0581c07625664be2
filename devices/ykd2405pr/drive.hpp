#pragma once

#include <memory>

#include "devices/descriptor.hpp"

namespace axisd::ykd2405pr {

std::unique_ptr<Drive> make_drive(DriveContext context);

}  // namespace axisd::ykd2405pr
