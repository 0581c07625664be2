// The axes of the plant, as their configuration and their drives are made.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "devices/axis/axis.hpp"
#include "tests/chaos/dice.hpp"
#include "tests/chaos/journey.hpp"
#include "tests/chaos/witness.hpp"

namespace axisd::chaos {

inline constexpr double pulses_per_mm = 100;

/// What somebody at the machine can actuate beside its switches.
enum class Wired : std::uint8_t { nothing, jog, homing, segment, free };

/// An axis with the drive behind it.
struct Station {
  std::string name;
  std::string bus;
  std::uint8_t node = 0;
  std::string model;
  std::string sheet{};  ///< of model cia402: its data sheet, from the root of the tree
  /// Its drive is made of the data sheet, and does by the dice what CiA 402 leaves to its maker.
  bool habits = false;
  bool invert = false;
  bool limited = true;           ///< it has position limits: velocity runs as a move to them
  Wired wired = Wired::nothing;  ///< to X3
  Track track{};
  Witness* drive = nullptr;
  Axis* axis = nullptr;
  TimePoint silent_until{};    ///< an outage: nothing passes from or to it
  TimePoint actuated_until{};  ///< so long what a terminal started may go on, or begin
  TimePoint released_until{};  ///< by a terminal: until then it could be turned by hand

  [[nodiscard]] bool on_can() const { return model == "yss-c" || model == "cia402"; }
  [[nodiscard]] bool closed_loop() const { return model != "ykd2405pr"; }
  [[nodiscard]] bool terminal_may_start(TimePoint now) const { return now <= actuated_until; }
};

/// 32 registers of each RS-485 drive with values of their own: its table of positions.
inline constexpr std::uint16_t marked_registers = 0x0090;
inline constexpr int marked_count = 32;
/// What marked register `offset` of a node holds.
std::uint16_t mark(std::uint8_t node, int offset);

/// Decides what is wired to X3, and with it what can be asked of the axis. 100 pulses per mm, 100 mm/s,
/// limits 0..400 mm if it is limited; homing where the model can be mirrored.
AxisSettings make_axis(Station& station, Dice& dice);
/// The home switch is 50 mm below the position at power-up, the limit switches 150 mm to both sides. Open
/// points of the manuals are one way or the other.
simulation::SimulatedNodeSettings make_drive(const Station& station, Dice& dice);

}  // namespace axisd::chaos
