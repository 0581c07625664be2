// Which drive model answers at an address of an RS-485 line.
#pragma once

#include "buses/modbus_rtu/node.hpp"
#include "devices/descriptor.hpp"

namespace axisd {

/// The model whose code is `code`; where several share it, the one whose probe registers fit (a read that the
/// drive refuses means that it has no such register). nullptr: none of those known here. Errors: no_reply,
/// bus_down.
Task<Result<const DriveDescriptor*>> find_rtu_model(const modbus_rtu::Node& node, std::uint16_t code,
                                                    TransactionOptions options);
/// Does this model, by its probe registers, answer at `node`? Errors as above.
Task<Result<bool>> probes_fit(const modbus_rtu::Node& node, const RtuIdentification& identification,
                              TransactionOptions options);

}  // namespace axisd
