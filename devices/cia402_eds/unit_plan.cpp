#include "devices/cia402_eds/unit_plan.hpp"

#include <fmt/format.h>

#include <string_view>

namespace axisd::cia402_eds {

namespace {

using canopen::Eds;
using canopen::Object;
using cia402::UnitSource;
using cia402::UnitTold;
using cia402::Values;

constexpr Object polarity{0x607E, 0};

/// What the file says that the unit objects hold; `fixed`: those that the drive cannot change.
struct FileValues {
  Values all, fixed;
};
FileValues values_of(const Eds& eds) {
  FileValues values;
  for (const auto object : cia402::unit_objects()) {
    const auto* entry = eds.find(object);
    if (entry == nullptr || !entry->known() || entry->known()->plus_node_id) continue;
    values.all[object.key()] = entry->known()->value;
    if (!canopen::writable(entry->access)) values.fixed[object.key()] = entry->known()->value;
  }
  // No key says otherwise: whatever the access, such a drive is refused.
  if (const auto found = values.all.find(polarity.key()); found != values.all.end())
    values.fixed.insert(*found);
  return values;
}

std::string_view choice(const std::map<std::string, SettingValue>& settings, const std::string& key) {
  const auto found = settings.find(key);
  const auto* text = found == settings.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text == nullptr ? std::string_view() : std::string_view(*text);
}

std::unexpected<Error> no_velocity_unit(const UnitTold& told) {
  const auto why = told.kind == UnitTold::Kind::nothing
                       ? std::string("nothing in it tells what the drive's velocities count (60A9h)")
                       : fmt::format("what the drive's velocities count is not clear: {}", told.what);
  return fail(
      Reason::invalid_argument, why,
      "write what the drive's manual says of 6081h and 60FFh: drive: { velocity_unit: UNIT }, such as "
      "rpm, 0.1rpm, rev_per_second or pulses_per_second; a wrong unit makes the motor too fast");
}

}  // namespace

Result<cia402::Units> plan_units(const Eds& eds, const std::map<std::string, SettingValue>& settings) {
  const auto values = values_of(eds);
  const auto told = cia402::told_velocity(values.all);
  const auto key = cia402::unit_named(choice(settings, "velocity_unit"));
  if (!key && told.kind != UnitTold::Kind::unit) return no_velocity_unit(told);
  cia402::Units units{
      .velocity = key.value_or(told.unit),
      .ramps = choice(settings, "ramps") == "time" ? cia402::Ramps::times : cia402::Ramps::rates,
      .velocity_source = key ? UnitSource::configuration : UnitSource::data_sheet};
  const auto ramps = cia402::told_acceleration(values.all);
  const auto ramp_key = cia402::unit_named(choice(settings, "acceleration_unit"));
  if (ramp_key && units.ramps == cia402::Ramps::times)
    return fail(Reason::invalid_argument, "drive.acceleration_unit has no effect with ramps: time",
                "leave one of them out");
  units.acceleration = ramp_key.value_or(ramps.kind == UnitTold::Kind::unit ? ramps.unit : units.velocity);
  units.acceleration_source = ramp_key ? UnitSource::configuration : UnitSource::data_sheet;
  auto conflict = cia402::find_conflict(units, std::nullopt, values.fixed);
  if (!conflict && ramps.kind == UnitTold::Kind::unclear) {
    auto by_key = units;  // so that the ramps alone are judged
    by_key.velocity_source = UnitSource::configuration;
    if (told.kind == UnitTold::Kind::unit) by_key.velocity = told.unit;
    conflict = cia402::find_conflict(by_key, std::nullopt, values.all);
  }
  if (conflict) return fail(Reason::invalid_argument, conflict->message, conflict->remedy);
  return units;
}

std::optional<cia402::PlanConflict> doubtful_units(const Eds& eds, const cia402::Units& planned) {
  return cia402::find_conflict(planned, std::nullopt, values_of(eds).all);
}

std::vector<Object> unit_objects_of(const Eds& eds) {
  std::vector<Object> objects;
  for (const auto object : cia402::unit_objects())
    if (const auto* entry = eds.find(object); entry != nullptr && canopen::readable(entry->access))
      objects.push_back(object);
  return objects;
}

}  // namespace axisd::cia402_eds
