// Types of parameters and objects: the contract's against the descriptors'.
#pragma once

#include <cstddef>
#include <optional>

#include "axisd/v1/drive_service.pb.h"
#include "devices/descriptor.hpp"

namespace axisd::server {

[[nodiscard]] v1::ParameterType to_proto(ParameterType type);
/// nullopt: unspecified, or none that this release knows.
[[nodiscard]] std::optional<ParameterType> from_proto(v1::ParameterType type);
/// Bytes; 0 for what from_proto() does not know.
[[nodiscard]] std::size_t size_of(v1::ParameterType type);
[[nodiscard]] bool is_signed(v1::ParameterType type);

}  // namespace axisd::server
