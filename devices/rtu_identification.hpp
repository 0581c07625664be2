// Which drive model answers at an address of an RS-485 line.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "buses/modbus_rtu/node.hpp"
#include "devices/descriptor.hpp"

namespace axisd {

/// The reads that show models, each once. The one that shows most of them comes first, so that a line of such
/// drives is asked nothing else.
std::span<const RtuRead> rtu_identity_reads();
/// Models whose code `registers`, the answer to `read`, show.
std::vector<const DriveDescriptor*> rtu_models_with_code(RtuRead read,
                                                         std::span<const std::uint16_t> registers);

/// The first of `models` whose probe registers fit (a read that the drive refuses means that it has no such
/// register). nullptr: none. Errors: no_reply, bus_down.
Task<Result<const DriveDescriptor*>> find_fitting_model(const modbus_rtu::Node& node,
                                                        std::vector<const DriveDescriptor*> models,
                                                        TransactionOptions options);
/// Does this model, by its probe registers, answer at `node`? Errors as above.
Task<Result<bool>> probes_fit(const modbus_rtu::Node& node, const RtuIdentification& identification,
                              TransactionOptions options);

}  // namespace axisd
