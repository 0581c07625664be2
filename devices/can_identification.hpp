// Which drive model answers at a node-ID of a CAN network.
#pragma once

#include "buses/canopen/remote_node.hpp"
#include "devices/descriptor.hpp"

namespace axisd {

/// The model with this vendor, product and profile; else, of a drive by CiA 402, the model that a data sheet
/// describes, which has no `can_identification`. nullptr: no drive. Pure.
const DriveDescriptor* find_can_model(const canopen::Identity& identity);

}  // namespace axisd
