#pragma once

#include <memory>

#include "devices/descriptor.hpp"

namespace axisd::yako_rtu {

std::unique_ptr<Drive> make_drive(DriveContext context);

}  // namespace axisd::yako_rtu
