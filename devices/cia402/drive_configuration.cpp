// The configuration in the drive: compare, write what differs, verify, and look whether it is still so.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/cia402/drive.hpp"
#include "devices/setup_codes.hpp"

namespace axisd::cia402 {

namespace {

/// Writes of the configuration may happen twice.
canopen::SdoOptions patiently() { return {.transaction_class = TransactionClass::parameters, .attempts = 3}; }

bool is_input_function(const ObjectSetting& setting) { return setting.key.starts_with("inputs."); }

std::vector<std::uint32_t> addresses_of(const std::vector<ObjectSetting>& settings) {
  std::vector<std::uint32_t> addresses;
  for (const auto& setting : settings) addresses.push_back(setting.address);
  return addresses;
}

}  // namespace

Task<Result<Values>> Cia402Drive::read_values(std::vector<std::uint32_t> addresses, SdoOptions options) {
  Values values;
  for (const auto address : addresses) {
    const auto value = co_await read_object(Object::of(address), options);
    if (!value) co_return fail(value.error());
    values[address] = *value;
  }
  co_return values;
}

Task<Result<void>> Cia402Drive::bring_to(std::vector<ObjectSetting> required) {
  auto addresses = addresses_of(required);
  const auto eeprom_switch = model_->objects.eeprom_switch;
  if (eeprom_switch) addresses.push_back(eeprom_switch->key());
  auto before = co_await read_values(std::move(addresses), patiently());
  if (!before) co_return fail(before.error());
  if (eeprom_switch) seen_.saving = before->at(eeprom_switch->key()) == 0;
  const auto written = co_await write_all(required, *before);
  // Also after a failure: what is written next must not wear the EEPROM.
  const auto restored = co_await save_writes(saves_at_rest());
  if (!written) co_return written;
  if (!restored) co_return restored;
  co_return co_await verify(required);
}

bool Cia402Drive::saves_at_rest() const { return setup_.persist == PersistSettings::all(); }

Task<Result<void>> Cia402Drive::save_writes(bool saved, std::uint64_t then) {
  if (!model_->objects.eeprom_switch || seen_.saving == saved) co_return Result<void>{};
  if (saved)
    if (const auto permitted = permit_saves(1 + then); !permitted) co_return permitted;
  seen_.saving.reset();
  const auto written = co_await write_object(*model_->objects.eeprom_switch, saved ? 0 : 1, 0, patiently());
  if (written || written.error().outcome == Outcome::unknown)
    count_save(1);  // whether this object saves itself is not said: counted
  if (!written) co_return written;
  seen_.saving = saved;
  co_return Result<void>{};
}

/// What can start motion is checked right before it is written; and before the switch of saving is turned,
/// which each further attempt would turn again, and wear.
Task<Result<void>> Cia402Drive::prepare_write(const ObjectSetting& setting) {
  // Of what no write saves the switch says nothing, and to turn it is a write itself.
  const bool turns = can_be_saved(setting.address) && seen_.saving != setting.saved;
  if (setting.starts_motion && turns)
    if (const auto inactive = co_await check_inactive(setting); !inactive) co_return inactive;
  if (turns)
    if (const auto switched = co_await save_writes(setting.saved, 1); !switched) co_return switched;
  if (setting.starts_motion) co_return co_await check_inactive(setting);
  co_return Result<void>{};
}

Task<Result<void>> Cia402Drive::write_all(const std::vector<ObjectSetting>& required, Values& present) {
  if (const auto done = co_await neutralise_inputs(required, present); !done) co_return done;
  for (const auto& setting : required) {
    const auto held = present.at(setting.address);
    if (setting.holds(held)) continue;  // spares the EEPROM
    // Again and again it would only wear the EEPROM.
    if (setting.saved && seen_.not_held.contains(setting.address)) co_return fail(not_held(setting, held));
    if (const auto ready = co_await prepare_write(setting); !ready) co_return ready;
    const auto written = co_await write_counted(setting.address, setting.applied_to(held), setting.bytes);
    if (!written) co_return written;
  }
  co_return Result<void>{};
}

/// Takes functions that can start motion off inputs that get another function or level: the new level could
/// act like an edge of the old function.
Task<Result<void>> Cia402Drive::neutralise_inputs(const std::vector<ObjectSetting>& required,
                                                  Values& present) {
  if (!model_->objects.input_levels) co_return Result<void>{};
  const auto level_address = model_->objects.input_levels->key();
  const auto levels = std::ranges::find(required, level_address, &ObjectSetting::address);
  if (levels == required.end()) co_return Result<void>{};
  const auto turned = static_cast<std::uint32_t>(present.at(level_address) ^ levels->value);
  for (const auto& input : required) {
    if (!is_input_function(input)) continue;
    auto& function = present.at(input.address);
    const bool changes = function != input.value || (turned & input.input_bits) != 0;
    if (!changes || !starts_motion(model_->descriptor->input_functions, function)) continue;
    if (const auto switched = co_await save_writes(input.saved, 1); !switched) co_return switched;
    if (const auto written = co_await write_counted(input.address, 0, input.bytes); !written)
      co_return written;
    function = 0;
  }
  co_return Result<void>{};
}

Task<Result<void>> Cia402Drive::check_inactive(const ObjectSetting& setting) {
  std::vector<std::uint32_t> addresses;
  for (const auto object : state_objects(*model_)) addresses.push_back(object.key());
  if (model_->objects.moving) addresses.push_back(model_->objects.moving->key());
  const auto values = co_await read_values(std::move(addresses), patiently());
  if (!values) co_return fail(values.error());
  const auto state = decoded(*values);
  if (state.enabled || state.moving || (state.inputs & setting.input_bits) != 0)
    co_return fail(error_at(
        Reason::misconfigured, Object::of(setting.address),
        fmt::format("{} can start motion and is only written while the drive is released and the input "
                    "inactive",
                    setting.key),
        "release the drive and open the input; it is tried again by itself"));
  co_return Result<void>{};
}

Task<Result<void>> Cia402Drive::write_counted(std::uint32_t address, std::int64_t value, std::uint8_t bytes) {
  if (is_saved(address))
    if (const auto permitted = permit_saves(1); !permitted) co_return permitted;
  const auto written = co_await write_object(Object::of(address), value, bytes, patiently());
  if (written || written.error().outcome == Outcome::unknown) count_write(address);
  co_return written;
}

bool Cia402Drive::can_be_saved(std::uint32_t address) const {
  const auto* parameter = find_parameter(model_->descriptor->parameters, address);
  return parameter != nullptr && parameter->access == Access::rw_saved;
}

bool Cia402Drive::is_saved(std::uint32_t address) const {
  return can_be_saved(address) && seen_.saving.value_or(true);
}

void Cia402Drive::count_write(std::uint32_t address) {
  if (is_saved(address)) count_save(1);
}

Error Cia402Drive::not_held(const ObjectSetting& setting, std::int64_t actual) const {
  return error_at(
      Reason::misconfigured, Object::of(setting.address),
      fmt::format("{} reads {} after {} was written", setting.key, actual, setting.applied_to(actual)),
      "check whether another master writes to this drive, or its EEPROM fails; what is saved is "
      "written again after the drive's next power-up");
}

Task<Result<void>> Cia402Drive::verify(const std::vector<ObjectSetting>& required) {
  const auto after = co_await read_values(addresses_of(required), patiently());
  if (!after) co_return fail(after.error());
  for (const auto& setting : required)
    if (const auto actual = after->at(setting.address); !setting.holds(actual)) {
      if (setting.saved) seen_.not_held.insert(setting.address);
      co_return fail(not_held(setting, actual));
    }
  co_return Result<void>{};
}

Task<Result<Drift>> Cia402Drive::check_drift(TransactionOptions options) {
  const SdoOptions asked{.transaction_class = options.transaction_class,
                         .deadline = options.deadline,
                         .guard = std::move(options.guard)};
  std::vector<ObjectSetting> watched;
  if (model_->objects.eeprom_switch)
    watched.push_back({.address = model_->objects.eeprom_switch->key(),
                       .value = saves_at_rest() ? 0 : 1,
                       .key = "persist"});
  for (const auto& setting : setup_objects_.required)  // homing's objects are compared before each homing
    if (!setting.key.starts_with("homing.")) watched.push_back(setting);
  const auto present = co_await read_values(addresses_of(watched), asked);
  if (!present) co_return fail(present.error());
  Drift drift;
  for (const auto& setting : watched) {
    const auto actual = present->at(setting.address);
    if (setting.holds(actual)) continue;
    drift.text += fmt::format("{}{} ({}) reads {} instead of {}", drift.text.empty() ? "" : "; ", setting.key,
                              object_text(setting.address), actual, setting.applied_to(actual));
    drift.scale_changed = drift.scale_changed || setting.key == "scale.microstep";
    drift.limits_changed =
        drift.limits_changed || setting.key == "drive.overtravel_stop" || setting.key.starts_with("inputs");
  }
  const auto units = co_await unit_conflict(asked);
  if (!units) co_return fail(units.error());
  const auto braking = co_await deceleration_conflict(asked);
  if (!braking) co_return fail(braking.error());
  if (const auto quick = co_await read_quick_stop_ramp(asked); !quick) co_return fail(quick.error());
  for (const auto* conflict : {&*units, &*braking})
    if (*conflict) drift.text += (drift.text.empty() ? "" : "; ") + (*conflict)->message;
  drift.scale_changed = drift.scale_changed || units->has_value();
  drift.limits_changed = drift.limits_changed || braking->has_value();
  co_return drift;
}

}  // namespace axisd::cia402
