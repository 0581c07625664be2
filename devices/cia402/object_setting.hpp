// One object of the dictionary as a configuration wants it.
#pragma once

#include <cstdint>
#include <string>

namespace axisd::cia402 {

struct ObjectSetting {
  std::uint32_t address = 0;     ///< index << 8 | sub-index
  std::int64_t value = 0;        ///< with its sign, as read_object() returns it
  std::uint8_t bytes = 2;        ///< by the model's dictionary; another size is negotiated with the drive
  std::string key{};             ///< of the configuration that decides it: "inputs.X0"
  std::int64_t mask = -1;        ///< bits that the configuration decides; the others stay as they are
  bool saved = false;            ///< goes to the EEPROM (`persist:`)
  bool starts_motion = false;    ///< written only while released and `input_bits` are inactive
  std::uint32_t input_bits = 0;  ///< of DriveSample::inputs

  [[nodiscard]] bool holds(std::int64_t present) const { return (present & mask) == (value & mask); }
  [[nodiscard]] std::int64_t applied_to(std::int64_t present) const {
    return (present & ~mask) | (value & mask);
  }
};

}  // namespace axisd::cia402
