// Which register contents a DriveSetup means, in the order in which they are written (M3). Pure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "buses/error.hpp"
#include "devices/drive.hpp"
#include "devices/yako_rtu/model.hpp"

namespace axisd::yako_rtu {

struct RegisterSetting {
  std::uint16_t address = 0;
  std::uint16_t value = 0;
  std::string key{};             ///< of the configuration that decides it: "inputs.X0"
  std::uint16_t mask = 0xFFFF;   ///< bits that the configuration decides; the others stay as they are
  bool saved = false;            ///< goes to the EEPROM (`persist:`)
  bool starts_motion = false;    ///< written only while released and `input_bits` are inactive
  std::uint32_t input_bits = 0;  ///< of DriveSample::inputs

  [[nodiscard]] bool holds(std::uint16_t present) const { return (present & mask) == value; }
  [[nodiscard]] std::uint16_t applied_to(std::uint16_t present) const {
    return static_cast<std::uint16_t>((present & ~mask) | value);
  }
};

/// Register of the first input's function, by the model or the reading of the manual that the setup names.
std::uint16_t first_input_function(const Model& model, const DriveSetup& setup);
/// Everything but the EEPROM switch (0x0016), whose state follows `persist`. Inputs that the setup does not
/// name are set to "none": a function left in the EEPROM (JOG, start) could move the axis behind its owner's
/// back. Outputs that it does not name are left alone: one may hold a brake.
Result<std::vector<RegisterSetting>> required_registers(const Model& model, const DriveSetup& setup);

/// The rows of a segment table. `enables`: inputs that could start one while it is being written.
std::vector<RegisterSetting> segment_registers(const DriveSegments& segments, std::uint32_t enables);
/// Inputs of the setup whose function is one of those that start segments.
std::uint32_t segment_enables(const Model& model, const DriveSetup& setup);

}  // namespace axisd::yako_rtu
