#pragma once

#include <cstdint>

namespace axisd {

/// What is spoken on a bus.
enum class BusKind : std::uint8_t { modbus_rtu, canopen };

}  // namespace axisd
