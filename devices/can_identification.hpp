// Which drive model answers at a node-ID of a CAN network.
#pragma once

#include "buses/canopen/remote_node.hpp"
#include "devices/descriptor.hpp"

namespace axisd {

/// The model with this vendor, product and profile; nullptr: none of those known here. Pure.
const DriveDescriptor* find_can_model(const canopen::Identity& identity);

}  // namespace axisd
