// Which objects' contents a DriveSetup means, in the order in which they are written (M3). Pure.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "buses/error.hpp"
#include "devices/cia402/encoding.hpp"
#include "devices/cia402/model.hpp"
#include "devices/cia402/object_setting.hpp"
#include "devices/drive.hpp"

namespace axisd::cia402 {

/// Everything but the EEPROM switch, whose state follows `persist` and which the driver sets before each of
/// these, and the homing method, whose code is negotiated (6098h). Inputs that the setup does not name are
/// set to "none": a function left in the EEPROM (JOG, start) could move the axis behind its owner's back.
/// Outputs that it does not name are left alone. Errors: misconfigured (the model has no such terminal,
/// function or microstep).
Result<std::vector<ObjectSetting>> required_objects(const Model& model, const DriveSetup& setup);

/// The setting of a model whose manual leaves open what its terminal states show, and its choices.
inline constexpr std::string_view terminal_states_key = "terminal_states";
inline constexpr std::string_view terminal_states[] = {"active", "level"};

/// What the states of terminals show that are active low by the setup. An output that it does not name is
/// taken as it is shown.
ActiveLow active_low(const Model& model, const DriveSetup& setup);

/// What a setup means in objects.
struct SetupObjects {
  SetupObjects(const Model& model, const DriveSetup& setup);

  std::vector<ObjectSetting> required;  ///< empty if it cannot be had
  ActiveLow active_low;
  std::optional<Error> error;  ///< why the drive cannot be configured
};

}  // namespace axisd::cia402
