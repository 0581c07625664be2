// Checks of bus requests, all before anything is sent. Which buses and nodes exist is checked in the core.
#pragma once

#include "axisd/v1/bus_service.pb.h"
#include "devices/bus_access.hpp"

namespace axisd::server {

/// Errors: invalid_argument, out_of_range.
[[nodiscard]] Result<TransactRequest> to_transact(const v1::TransactRequest& from);
/// The same for read_object and write_object.
[[nodiscard]] Result<ObjectRequest> to_object_request(const v1::TransactRequest& from);
/// An object is meant, not registers.
[[nodiscard]] bool names_object(const v1::TransactRequest& from);
/// Errors: invalid_argument, out_of_range.
[[nodiscard]] Result<ScanRequest> to_scan(const v1::ScanRequest& from);
/// A known device, a known and writable register, a finite value. Errors: invalid_argument.
[[nodiscard]] Result<void> check_device_write(const v1::WriteDeviceRequest& from, const BusAccess& buses);

}  // namespace axisd::server
