// A node on the line that is not an axis: named registers, read at a steady rate (M28).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "buses/clock.hpp"

namespace axisd {

/// How a value lies in holding registers; 32-bit ones take two, high word first.
enum class RegisterType : std::uint8_t { u16, i16, u32, i32, f32 };
/// Registers that a value of this type takes.
constexpr std::uint16_t register_count(RegisterType type) {
  return type == RegisterType::u16 || type == RegisterType::i16 ? 1 : 2;
}

struct RegisterSettings {
  std::string name;
  std::uint16_t address = 0;
  RegisterType type = RegisterType::u16;
  double scale = 1;  ///< value = raw x scale; not 0
  std::string unit;
  bool writable = false;
};

/// `devices:` NAME, model modbus-generic.
struct DeviceSettings {
  std::string name;
  std::string bus;
  std::uint8_t node = 1;
  Duration poll = std::chrono::milliseconds(500);
  std::vector<RegisterSettings> registers;
};

}  // namespace axisd
