// Which contents of a drive's registers or objects a DriveSetup means, in the order in which they are written
// (M3). Pure.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "buses/error.hpp"
#include "devices/descriptor.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// What registers or objects hold, by their addresses: a register's word, an object's number with its sign.
using SettingValues = std::map<std::uint32_t, std::int64_t>;

/// One register or object as a configuration wants it.
struct DriveSetting {
  std::uint32_t address = 0;  ///< Modbus register, or CANopen index << 8 | sub-index
  std::int64_t value = 0;
  std::string key{};           ///< of the configuration that decides it: "inputs.X0"
  std::int64_t mask = -1;      ///< bits that the configuration decides; the others stay as they are
  bool saved = false;          ///< goes to the EEPROM (`persist:`)
  bool obeys_switch = true;    ///< false: it is never saved, so saving is not switched for it
  bool watched = true;         ///< drift is looked for; else it is compared before each use, or moves nothing
  bool starts_motion = false;  ///< written only while released and `input_bits` are inactive
  std::uint32_t input_bits = 0;  ///< of DriveSample::inputs

  [[nodiscard]] bool holds(std::int64_t present) const { return (present & mask) == (value & mask); }
  [[nodiscard]] std::int64_t applied_to(std::int64_t present) const {
    return (present & ~mask) | (value & mask);
  }
};

/// An input's function, and not the levels of all of them.
[[nodiscard]] bool is_input_function(const DriveSetting& setting);
std::vector<std::uint32_t> addresses_of(std::span<const DriveSetting> settings);

/// Where a model keeps what all models have. Nothing: it has no such place.
struct SettingPlaces {
  std::optional<std::uint32_t> input_levels{}, first_input_function{};  ///< the other inputs' follow
  std::optional<std::uint32_t> output_levels{}, first_output_function{};
  std::optional<std::uint32_t> microstep{};
  std::span<const std::int32_t> microstep_codes{};  ///< pulses per revolution in the order of the codes
};

/// Levels of terminals, limits and stops, microstep, the model's own settings, homing, outputs, other inputs.
/// Inputs that the setup does not name are set to "none": a function left in the EEPROM (JOG, start) could
/// move the axis behind its owner's back. Outputs that it does not name are left alone: one may hold a brake.
/// `homing`: encoded; empty if the setup has none. Errors: misconfigured (the model has no such terminal,
/// function or microstep).
Result<std::vector<DriveSetting>> required_settings(const DriveDescriptor& model, const DriveSetup& setup,
                                                    const SettingPlaces& places,
                                                    std::vector<DriveSetting> homing);

}  // namespace axisd
