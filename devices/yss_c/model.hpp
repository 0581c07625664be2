#pragma once

#include "devices/cia402/model.hpp"
#include "devices/descriptor.hpp"

namespace axisd::yss_c {

/// What the YSS-C is, for everybody. Lives as long as the program.
const DriveDescriptor& descriptor();
/// What the CiA 402 driver has to know of it beside that. Likewise.
const cia402::Model& model();

}  // namespace axisd::yss_c
