// A node of a bus that is not an axis: named values, read at a steady rate (M28).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "devices/bus_kind.hpp"

namespace axisd {

/// How a value lies in a register or an object. Registers have 16 bits; what is longer takes two, high word
/// first. 8-bit values are for objects only.
enum class ValueType : std::uint8_t { u16, i16, u32, i32, f32, u8, i8 };
/// Bytes of an object that holds a value of this type.
constexpr std::uint16_t byte_count(ValueType type) {
  switch (type) {
    case ValueType::u8:
    case ValueType::i8:
      return 1;
    case ValueType::u16:
    case ValueType::i16:
      return 2;
    default:
      return 4;
  }
}
/// Registers that a value of this type takes.
constexpr std::uint16_t register_count(ValueType type) { return byte_count(type) == 4 ? 2 : 1; }

struct ValueSettings {
  std::string name;
  std::uint32_t address = 0;  ///< register, or object: index << 8 | sub-index
  ValueType type = ValueType::u16;
  double scale = 1;  ///< value = raw x scale; not 0
  std::string unit;
  bool writable = false;
};

/// `devices:` NAME, model modbus-generic or canopen-generic.
struct DeviceSettings {
  std::string name;
  std::string bus;
  BusKind kind = BusKind::modbus_rtu;
  std::uint8_t node = 1;
  Duration poll = std::chrono::milliseconds(500);
  std::optional<Duration> turnaround_max{};  ///< RS-485: of this node; nothing: its line's
  std::vector<ValueSettings> values;
  /// What its values are called in messages.
  [[nodiscard]] std::string_view noun() const { return kind == BusKind::modbus_rtu ? "register" : "object"; }
};

}  // namespace axisd
