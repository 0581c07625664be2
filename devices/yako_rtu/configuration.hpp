// Which register contents a DriveSetup means, in the order in which they are written (M3). Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "buses/error.hpp"
#include "devices/drive.hpp"

namespace axisd::yako_rtu {

struct RegisterSetting {
  std::uint16_t address;
  std::uint16_t value;
  /// Written only while the drive is released and the terminal's input is inactive: it can start motion.
  bool starts_motion = false;
  std::uint32_t input_bit = 0;  ///< of that terminal, in DriveSample::inputs
};

inline constexpr std::uint16_t input_count = 10;  ///< PU, DR, X0..X7
/// An input with this function code (0x0041..0x004A) can start a motion.
bool starts_motion(std::uint16_t function_code);

/// Inputs that the setup does not name are set to "none": a function left in the EEPROM (JOG, start) could
/// move the axis behind its owner's back. Outputs that it does not name are left alone: one may hold a brake.
Result<std::vector<RegisterSetting>> required_registers(const DriveSetup& setup);

}  // namespace axisd::yako_rtu
