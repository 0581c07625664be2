#include "tests/chaos/station.hpp"

#include <array>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "buses/canopen/eds.hpp"
#include "devices/descriptor.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::chaos {

using namespace std::chrono_literals;

namespace {

/// 0x011F and 204Fh by default; in pulses, as the encoders of these drives are no coarser than their pulses.
constexpr std::int64_t in_position_window = 10;
/// That a reading of their encoders is off, in pulses: a shaft within the window may be further away by it.
constexpr int largest_noise = 2;

/// A terminal that releases the motor is no more than the daemon can see where the position is measured: in
/// open loop nothing tells what the load did meanwhile.
Wired choose_wired(const Station& station, Dice& dice) {
  constexpr std::array choices{Wired::nothing, Wired::jog, Wired::homing, Wired::segment, Wired::free};
  const auto chosen = dice.pick(choices);
  if (station.model == "cia402") return Wired::nothing;  // its inputs have one meaning each
  if (chosen == Wired::free && !station.closed_loop()) return Wired::nothing;
  const bool has_segments = station.model == "ykd2405pr" || station.model == "ssd2608pr";
  return chosen == Wired::segment && !has_segments ? Wired::jog : chosen;
}

void assign_inputs(const Station& station, AxisSettings& axis) {
  const bool standard = station.model == "cia402";
  const auto use = [&](const char* terminal, const char* function) {
    axis.inputs.push_back({.terminal = terminal, .function = function});
  };
  use(standard ? "HOME" : "X0", "home");
  // Where a terminal has one meaning, it is that of the drive's direction.
  use(standard ? "POS" : "X1", standard && station.invert ? "negative_limit" : "positive_limit");
  use(standard ? "NEG" : "X2", standard && station.invert ? "positive_limit" : "negative_limit");
  switch (station.wired) {
    case Wired::nothing:
      break;
    case Wired::jog:
      use("X3", "jog_positive");
      break;
    case Wired::homing:
      use("X3", "homing_start");
      break;
    case Wired::free:
      use("X3", "motor_free");
      break;
    case Wired::segment:
      use("X3", "pt_enable");
      use("X4", "pin0");
      axis.segments = SegmentSettings{.positions = {{.number = 1, .target = -7, .velocity = 60}}};
      break;
  }
}

/// A data sheet, which is read once.
struct Described {
  std::map<std::string, SettingValue> settings;
  std::shared_ptr<const DriveDescriptor> descriptor;
  std::shared_ptr<const canopen::Eds> eds;
};
const Described& described(const std::string& sheet) {
  static std::map<std::string, Described> all;
  auto& one = all[sheet];
  if (one.descriptor) return one;
  const auto path = test::in_source_tree(sheet);
  one.settings = {{"eds", path},
                  {"velocity_unit", std::string("pulses_per_second")},
                  {"ramps", std::string("rate")},
                  {"loop_mode", std::string("closed")}};
  const auto* model = find_drive_model("cia402");
  const auto special = model->specialise(*model, one.settings);
  if (!special) throw std::runtime_error(to_string(special.error()));
  auto eds = canopen::load_eds(path);
  if (!eds) throw std::runtime_error(to_string(eds.error()));
  one.eds = std::make_shared<const canopen::Eds>(std::move(*eds));
  one.descriptor = *special;
  return one;
}

/// What CiA 402 leaves to the maker, and neither the judge's slack nor its limits depend on.
void give_habits(simulation::SimulatedNodeSettings& settings, Dice& dice) {
  for (const auto* name :
       {"halt_release_drops", "halt_release_keeps_velocity_at_0", "set_point_in_halt_refused",
        "homing_attained_forgotten", "homing_goes_on_without_start_bit", "homing_pauses", "acknowledges_late",
        "acknowledgement_ends_with_motion", "set_points_change_at_once", "error_code_kept",
        "velocity_wavers_at_rest", "velocity_wavers_by_threshold", "segmented_uploads"})
    settings.switches[name] = dice.chance(0.3);
  settings.switches[dice.chance(0.5) ? "homing_attained_early" : "homing_attained_late"] = dice.chance(0.5);
}

}  // namespace

std::uint16_t mark(std::uint8_t node, int offset) {
  return static_cast<std::uint16_t>(0x4000 + node * 0x100 + offset);
}

AxisSettings make_axis(Station& station, Dice& dice) {
  AxisSettings axis{.name = station.name, .bus = station.bus, .node = station.node, .model = station.model};
  axis.scale = {
      .pulses_per_revolution = 1000, .travel_numerator = 10, .invert = station.invert, .unit = "mm"};
  if (station.limited) {
    axis.limits.position_minimum = 0;
    axis.limits.position_maximum = 400;
  }
  axis.limits.velocity = 100;
  // The closed loop models of this maker cannot home an inverted axis.
  if (!station.invert || !station.closed_loop())
    axis.homing = HomingSettings{.method = HomingMethod::home_negative,
                                 .velocity = 20,
                                 .search_velocity = 2,
                                 .position = 0,
                                 .backoff = 5,
                                 .timeout = 30s};
  axis.jog_travel = 10;
  if (!station.sheet.empty()) {
    axis.model_settings = described(station.sheet).settings;
    axis.own_descriptor = described(station.sheet).descriptor;
  }
  station.wired = choose_wired(station, dice);
  assign_inputs(station, axis);
  station.track = {.pulses_per_unit = station.invert ? -pulses_per_mm : pulses_per_mm,
                   .slack = station.closed_loop() ? 1 + in_position_window + largest_noise : 1,
                   .minimum = axis.limits.position_minimum,
                   .maximum = axis.limits.position_maximum,
                   .jog_travel = axis.jog_travel,
                   .backoff = axis.homing ? *axis.homing->backoff : 0};
  return axis;
}

simulation::SimulatedNodeSettings make_drive(const Station& station, Dice& dice) {
  simulation::SimulatedNodeSettings settings{.address = station.node, .boot_time = 101ms + dice.up_to(300ms)};
  const auto at = [](double mm) { return static_cast<std::int64_t>(mm * pulses_per_mm); };
  settings.mechanics.home_switch_from = at(station.invert ? 50 : -52);
  settings.mechanics.home_switch_to = at(station.invert ? 52 : -50);
  settings.mechanics.positive_limit_from = at(150);
  settings.mechanics.negative_limit_from = at(-150);
  if (station.closed_loop())
    settings.encoder = {.noise = dice.pick(largest_noise + 1),
                        .following = dice.up_to(5ms),
                        .quantised = dice.chance(0.5),
                        .compliance = dice.pick(6)};
  if (station.habits) {
    settings.sheet = described(station.sheet).eds;
    settings.encoder.noise = 1 + dice.pick(largest_noise);  // always some
    give_habits(settings, dice);
  }
  if (station.model == "cia402") return settings;
  settings.switches["abrupt_stop_slips"] = dice.chance(0.3);
  if (station.closed_loop()) settings.switches["position_is_commanded"] = dice.chance(0.2);
  if (station.on_can()) return settings;
  settings.switches["crc_error_answered"] = dice.chance(0.3);
  // What can start motion is assigned to a terminal of a released drive only (M3).
  const bool starts = station.wired != Wired::nothing && station.wired != Wired::free;
  settings.switches["enabled_at_power_up"] = !starts && dice.chance(0.7);
  for (int i = 0; i < marked_count; ++i) settings.eeprom[marked_registers + i] = mark(station.node, i);
  return settings;
}

}  // namespace axisd::chaos
