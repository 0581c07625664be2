// Checks of drive requests, all before anything is sent. What depends on the axis's state or configuration
// (enabled, moving, owned by the YAML) is checked in the core.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "axisd/v1/drive_service.pb.h"
#include "devices/machine.hpp"

namespace axisd::server {

/// An axis and the data of its model.
struct KnownDrive {
  AxisSnapshotPtr axis;
  const DriveDescriptor* model = nullptr;  ///< never null
};

/// Errors: invalid_argument, unknown_axis.
[[nodiscard]] Result<KnownDrive> find_drive(const Machine& machine, const std::string& axis);

/// The addresses of the named parameters, or of all that can be read. Errors: invalid_argument (unknown, with
/// the nearest name; write-only; named twice).
[[nodiscard]] Result<std::vector<std::uint32_t>> parameters_to_read(const v1::ReadParametersRequest& from,
                                                                    const KnownDrive& drive);
/// Errors: invalid_argument (none, unknown, named twice, read-only, trigger: names the RPC), out_of_range.
[[nodiscard]] Result<std::vector<ParameterValue>> parameters_to_write(const v1::WriteParametersRequest& from,
                                                                      const KnownDrive& drive);

/// `confirm` must repeat the axis's name. Errors: invalid_argument.
[[nodiscard]] Result<void> check_confirmed(std::string_view axis, std::string_view confirm);

/// Errors: invalid_argument, out_of_range, naming the segment and the field.
[[nodiscard]] Result<SegmentSettings> segments_to_write(const v1::SegmentTable& from,
                                                        const KnownDrive& drive);

// Another address, other serial settings. Errors: invalid_argument, out_of_range.
[[nodiscard]] Result<SerialChange> serial_change(const v1::ReaddressRequest& from, const KnownDrive& drive);
[[nodiscard]] Result<SerialChange> serial_change(const v1::SetSerialRequest& from, const KnownDrive& drive);

}  // namespace axisd::server
