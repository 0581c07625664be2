// Which register contents a DriveSetup means, in the order in which they are written (M3). Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "buses/error.hpp"
#include "devices/drive.hpp"
#include "devices/drive_settings.hpp"
#include "devices/yako_rtu/model.hpp"

namespace axisd::yako_rtu {

/// Register of the first input's function, by the model or the reading of the manual that the setup names.
std::uint16_t first_input_function(const Model& model, const DriveSetup& setup);
/// Everything but the EEPROM switch (0x0016), whose state follows `persist`; the segment table comes last.
Result<std::vector<DriveSetting>> required_registers(const Model& model, const DriveSetup& setup);

/// The rows of a segment table. `enables`: inputs that could start one while it is being written.
std::vector<DriveSetting> segment_registers(const DriveSegments& segments, std::uint32_t enables, bool saved);
/// Inputs of the setup whose function is one of those that start segments.
std::uint32_t segment_enables(const Model& model, const DriveSetup& setup);
/// The speeds of each row of the table that is about to change, and has one: they are written as 0 first. A
/// row that a lost frame leaves half written must not be one that a terminal can start.
std::vector<DriveSetting> silenced_segments(std::span<const DriveSetting> required,
                                            const SettingValues& present, std::uint32_t enables, bool saved);

}  // namespace axisd::yako_rtu
