#include "devices/simulation/drive_option.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <memory>
#include <numbers>
#include <span>
#include <utility>

#include "buses/canopen/eds.hpp"
#include "devices/simulation/text.hpp"

namespace axisd::simulation {

namespace {

bool parse_range(std::string_view value, Mechanics& mechanics) {
  const auto colon = value.find(':');
  if (colon == std::string_view::npos) return false;
  const auto from = parse_number<std::int64_t>(value.substr(0, colon));
  const auto to = parse_number<std::int64_t>(value.substr(colon + 1));
  if (!from || !to || *from > *to) return false;
  mechanics.home_switch_from = from;
  mechanics.home_switch_to = to;
  return true;
}

bool parse_position(std::string_view value, std::optional<std::int64_t>& into) {
  into = parse_number<std::int64_t>(value);
  return into.has_value();
}

bool set_velocity_unit(std::string_view value, UnitSettings& units) {
  const auto unit = rate_unit_named(value);
  if (unit) units.velocity = *unit;
  return unit.has_value();
}

bool set_acceleration_unit(std::string_view value, UnitSettings& units) {
  const bool as_velocities = value == acceleration_unit_names[0];
  const auto unit = rate_unit_named(value == acceleration_unit_names[1] ? "rpm" : value);
  if (unit || as_velocities) units.acceleration = unit;
  return unit || as_velocities;
}

bool parse_switch(std::string_view name, std::string_view value, Switches& switches) {
  const auto on = parse_on_off(value);
  if (on) switches[std::string(name)] = *on;
  return on.has_value();
}

bool parse_eeprom(std::string_view address, std::string_view value, SimulatedNodeSettings& settings) {
  const auto at = parse_number<std::uint32_t>(address);
  const auto number = parse_number<std::int64_t>(value);
  if (!at || !number || *number < INT32_MIN || *number > UINT32_MAX) return false;
  settings.eeprom[*at] = static_cast<std::uint32_t>(*number);
  return true;
}

bool parse_wire(std::string_view terminal, std::string_view value, SimulatedNodeSettings& settings) {
  Wire wire;
  if (value.ends_with(":nc")) {
    wire.normally_closed = true;
    value.remove_suffix(3);
  }
  if (value == "home")
    wire.kind = SwitchKind::home;
  else if (value == "positive_limit")
    wire.kind = SwitchKind::positive_limit;
  else if (value == "negative_limit")
    wire.kind = SwitchKind::negative_limit;
  else
    return false;
  settings.wires[std::string(terminal)] = wire;
  return true;
}

bool parse_single(std::string_view key, std::string_view value, SimulatedNodeSettings& settings) {
  if (key == "turn") {
    const auto turn = parse_number<std::uint32_t>(value);
    if (turn) settings.mechanics.turn = *turn;
    return turn && *turn > 0;
  }
  if (key == "node") {
    const auto node = parse_number<std::uint8_t>(value);
    if (node) settings.address = *node;
    return node.has_value();
  }
  if (key == "dip") {
    const auto dip = parse_number<std::uint8_t>(value);
    settings.dip_address = dip;
    return dip.has_value();
  }
  if (key == "dip_baud") {
    settings.dip_baud = value == "custom" ? 0 : parse_number<int>(value);
    return settings.dip_baud && (value == "custom" || *settings.dip_baud > 0);
  }
  if (key == "powered") {
    const auto on = parse_on_off(value);
    if (on) settings.powered = *on;
    return on.has_value();
  }
  if (key != "boot_ms") return false;
  const auto milliseconds = parse_number<std::uint16_t>(value);
  if (milliseconds) settings.boot_time = std::chrono::milliseconds(*milliseconds);
  return milliseconds.has_value();
}

bool parse_part(std::string_view key, std::string_view value, DriveOption& option) {
  auto& settings = option.settings;
  const auto named = [&](std::string_view prefix) {
    return key.starts_with(prefix) && key.size() > prefix.size();
  };
  if (named("switch.")) return parse_switch(key.substr(7), value, settings.switches);
  if (named("eeprom.")) return parse_eeprom(key.substr(7), value, settings);
  if (named("encoder.")) return set_encoder_option(settings.encoder, key.substr(8), value);
  if (named("wire.")) return parse_wire(key.substr(5), value, settings);
  if (key == "home") return parse_range(value, settings.mechanics);
  if (key == "positive_limit") return parse_position(value, settings.mechanics.positive_limit_from);
  if (key == "negative_limit") return parse_position(value, settings.mechanics.negative_limit_from);
  if (key == "eds") {
    option.sheet = value;
    return !value.empty();
  }
  if (key == "counts" || key == "velocity_unit" || key == "acceleration_unit")
    return set_unit_option(settings.units, key, value);
  if (key == "model") {
    option.model = value;
    return !value.empty();
  }
  return parse_single(key, value, settings);
}

}  // namespace

std::optional<RateUnit> rate_unit_named(std::string_view name) {
  if (std::ranges::find(velocity_unit_names, name) == std::end(velocity_unit_names)) return std::nullopt;
  constexpr double minute = 60, degrees = 360;
  constexpr std::pair<std::string_view, double> angles[] = {{"rpm", 1 / minute},
                                                            {"rev_per_second", 1},
                                                            {"degrees_per_second", 1 / degrees},
                                                            {"radians_per_second", std::numbers::inv_pi / 2}};
  const auto angle =
      std::ranges::find_if(angles, [name](const auto& one) { return name.ends_with(one.first); });
  if (angle == std::end(angles)) return RateUnit{};
  double factor = 1;
  (void)std::from_chars(name.data(), name.data() + name.size() - angle->first.size(),
                        factor);  // "0.01", or none
  return RateUnit{factor * angle->second};
}

bool set_unit_option(UnitSettings& units, std::string_view name, std::string_view value) {
  if (name == "velocity_unit") return set_velocity_unit(value, units);
  if (name == "acceleration_unit") return set_acceleration_unit(value, units);
  const auto counts = parse_number<std::uint32_t>(value);
  if (name != "counts" || counts.value_or(0) == 0) return false;
  units.counts_per_revolution = *counts;
  return true;
}

Result<DriveOption> parse_drive(std::string_view text) {
  DriveOption option;
  option.settings.address = 0;
  for (const auto part : split(text, ',')) {
    const auto [key, value] = key_value(part);
    if (!parse_part(key, value, option))
      return fail(Reason::invalid_argument, fmt::format("\"{}\" is not understood", part),
                  fmt::format("use node=, model=, home=FROM:TO, turn=, positive_limit=, negative_limit=, "
                              "switch.NAME=on|off, eeprom.REGISTER=VALUE, "
                              "encoder.noise|following_ms|quantised|backlash|compliance|slip=, "
                              "wire.TERMINAL=home|positive_limit|negative_limit[:nc], dip=ADDRESS, "
                              "dip_baud=BAUD|custom, boot_ms=, powered=on|off; with a data sheet eds=FILE, "
                              "counts=PER_REVOLUTION, velocity_unit={}, acceleration_unit={}",
                              fmt::join(velocity_unit_names, "|"), fmt::join(acceleration_unit_names, "|")));
  }
  if (option.model.empty() || option.settings.address == 0)
    return fail(Reason::invalid_argument, fmt::format("\"{}\" names no drive", text),
                "give node= and model=");
  if (option.sheet.empty()) return option;
  auto sheet = canopen::load_eds(option.sheet);
  if (!sheet) return fail(sheet.error());
  option.settings.sheet = std::make_shared<const canopen::Eds>(std::move(*sheet));
  return option;
}

}  // namespace axisd::simulation
