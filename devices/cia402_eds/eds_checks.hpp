// What of a data sheet keeps the driver from running its drive, and what does not matter.
#pragma once

#include <string>
#include <vector>

#include "buses/canopen/eds.hpp"
#include "devices/cia402/objects.hpp"
#include "devices/cia402_eds/overrides.hpp"

namespace axisd::cia402_eds {

struct EdsFinding {
  int line = 0;  ///< of the file; 0: of no line
  std::string message;
  /// What would say it in the configuration: "6081h: { maximum: NUMBER }". Empty: nothing would.
  std::string settled_by{};
};

/// Objects that are missing, of the wrong kind or not writable, and flaws in what axisd takes from the file
/// of the objects that it uses. Precondition: apply_overrides() found nothing.
std::vector<EdsFinding> check_eds(const canopen::Eds& eds, const Overrides& overrides = {});
/// What to do about them, in one sentence.
std::string remedy_of(const std::vector<EdsFinding>& findings);
/// The other flaws, "FILE:LINE: ..." each, the first ones with the number of the rest.
std::vector<std::string> warnings_of(const canopen::Eds& eds, const Overrides& overrides,
                                     const std::string& path);

/// Why the drive has no profile velocity mode, by its objects; empty: it has it.
std::string velocity_mode_lack(const canopen::Eds& eds);
/// See cia402::Model::neutral_mode. Homing mode is entered and left there, and nothing homes: only that the
/// drive has the mode matters.
cia402::OperationMode neutral_mode_of(const canopen::Eds& eds);
/// 6502h; without it, or without its value, a drive is taken to have every mode.
bool supports(const canopen::Eds& eds, unsigned mode_bit);
/// The drive has it, and it is not read-only.
bool can_write(const canopen::Eds& eds, canopen::Object object);

namespace object {

using canopen::Object;

inline constexpr Object store_all{0x1010, 1}, restore_all{0x1011, 1}, identity_vendor{0x1018, 1},
    identity_product{0x1018, 2}, commanded_position{0x6062, 0}, position_window{0x6067, 0},
    velocity_threshold{0x606F, 0}, velocity_value{0x606C, 0}, homing_methods{0x60E3, 0},
    inputs_value{0x60FD, 0}, drive_modes{0x6502, 0};

}  // namespace object

}  // namespace axisd::cia402_eds
