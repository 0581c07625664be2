// Which objects' contents a DriveSetup means, in the order in which they are written (M3). Pure.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "buses/error.hpp"
#include "devices/cia402/encoding.hpp"
#include "devices/cia402/model.hpp"
#include "devices/drive.hpp"
#include "devices/drive_settings.hpp"

namespace axisd::cia402 {

/// Everything but the EEPROM switch, whose state follows `persist`, and the homing method, whose code is
/// negotiated (6098h). Errors: as of required_settings().
Result<std::vector<DriveSetting>> required_objects(const Model& model, const DriveSetup& setup);

/// The setting of a model whose manual leaves open what its terminal states show, and its choices.
inline constexpr std::string_view terminal_states_key = "terminal_states";
inline constexpr std::string_view terminal_states[] = {"active", "level"};

/// What the states of terminals show that are active low by the setup. An output that it does not name is
/// taken as it is shown.
ActiveLow active_low(const Model& model, const DriveSetup& setup);

/// The setup of a drive, and what is made of it once.
struct ObjectSetup : DriveSetup {
  ObjectSetup(const Model& model, DriveSetup setup)
      : DriveSetup(std::move(setup)), active_low(cia402::active_low(model, *this)) {}

  ActiveLow active_low;
};

}  // namespace axisd::cia402
