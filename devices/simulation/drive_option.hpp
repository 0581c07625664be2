// One simulated drive as text, for the command line.
#pragma once

#include <string>
#include <string_view>

#include "buses/error.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::simulation {

struct DriveOption {
  std::string model;
  std::string sheet;  ///< path of the data sheet; empty: none
  SimulatedNodeSettings settings;
};

/// "node=1,model=ykd2405pr,home=5000:6000,positive_limit=90000,negative_limit=-2000,switch.unsigned_speed=on,
/// eeprom.0x0011=13,encoder.noise=1,encoder.following_ms=8,wire.X0=home,wire.X1=positive_limit:nc,dip=0,dip_baud=custom,boot_ms=300,powered=off".
/// For a drive that its data sheet makes: "eds=drive.eds,counts=4096,velocity_unit=rpm,acceleration_unit=
/// rpm_per_second"; the file is read. node and model are needed. Errors name the part that is wrong. Models,
/// switches, terminals and what switches can be set to are checked by make_node().
Result<DriveOption> parse_drive(std::string_view text);

/// Units of velocities: counts of the position, then each angle in 10^0 to 10^-3.
/// Not the table of the driver: what a name means is read here and there independently.
inline constexpr std::string_view velocity_unit_names[] = {"pulses_per_second",
                                                           "rpm",
                                                           "0.1rpm",
                                                           "0.01rpm",
                                                           "0.001rpm",
                                                           "rev_per_second",
                                                           "0.1rev_per_second",
                                                           "0.01rev_per_second",
                                                           "0.001rev_per_second",
                                                           "degrees_per_second",
                                                           "0.1degrees_per_second",
                                                           "0.01degrees_per_second",
                                                           "0.001degrees_per_second",
                                                           "radians_per_second",
                                                           "0.1radians_per_second",
                                                           "0.01radians_per_second",
                                                           "0.001radians_per_second"};
inline constexpr std::string_view acceleration_unit_names[] = {"velocity_per_second", "rpm_per_second"};

/// Nothing: no unit has this name.
std::optional<RateUnit> rate_unit_named(std::string_view name);

/// Takes over what a data sheet may not tell, by name: counts=N, velocity_unit=NAME, acceleration_unit=NAME.
/// An acceleration may also be named as a velocity: what it counts in a second. False: no such option, or no
/// such value; nothing is changed then.
bool set_unit_option(UnitSettings& units, std::string_view name, std::string_view value);

}  // namespace axisd::simulation
