#include "devices/drive_configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "devices/setup_codes.hpp"

namespace axisd {

DriveConfiguration::DriveConfiguration(std::unique_ptr<DriveMemory> memory, MemoryTraits traits,
                                       Result<std::vector<DriveSetting>> required)
    : memory_(std::move(memory)), traits_(traits) {
  if (!required) {
    error_ = required.error();
    return;
  }
  required_ = std::move(*required);
  if (traits_.saving_switch)
    watched_.push_back(
        {.address = *traits_.saving_switch, .value = traits_.saves_at_rest ? 0 : 1, .key = "persist"});
  std::ranges::copy_if(required_, std::back_inserter(watched_), &DriveSetting::watched);
}

std::uint64_t DriveConfiguration::saves_of_setup() const {
  const auto saved = static_cast<std::uint64_t>(std::ranges::count_if(required_, &DriveSetting::saved));
  return saved == 0 ? 0 : saved + 2;  // two turn the switch, there and back
}

std::string DriveConfiguration::key_of(std::uint32_t address) const {
  const auto found = std::ranges::find(required_, address, &DriveSetting::address);
  return found == required_.end() ? std::string() : found->key;
}

void DriveConfiguration::forget_power_cycle() {
  saving_.reset();
  not_held_.clear();
}

Task<Result<void>> DriveConfiguration::apply() {
  if (error_) co_return fail(*error_);
  co_return co_await bring_to(required_);
}

Task<Result<void>> DriveConfiguration::bring_to(std::vector<DriveSetting> required) {
  auto addresses = addresses_of(required);
  if (traits_.saving_switch) addresses.push_back(*traits_.saving_switch);
  auto before = co_await memory_->read(std::move(addresses), DriveMemory::Moment::before);
  if (!before) co_return fail(before.error());
  if (traits_.saving_switch) saving_ = before->at(*traits_.saving_switch) == 0;
  const auto written = co_await write_all(required, std::move(*before));
  // Also after a failure: what is written next must not wear the EEPROM.
  const auto restored = co_await leave_switch();
  if (!written) co_return written;
  if (!restored) co_return restored;
  co_return co_await verify(std::move(required));
}

Task<Result<void>> DriveConfiguration::write_all(std::vector<DriveSetting> required, SettingValues present) {
  for (const auto& input : starting_inputs(required, present)) {
    if (const auto done = co_await neutralise(input); !done) co_return done;
    present.at(input.address) = 0;
  }
  for (const auto& one : memory_->silenced(required, present)) {
    if (const auto ready = co_await prepare_write(one); !ready) co_return ready;
    if (const auto written = co_await write(one.address, {0}); !written) co_return written;
    present.at(one.address) = 0;
  }
  for (std::size_t i = 0; i < required.size();) {
    const auto& first = required[i];
    const auto held = present.at(first.address);
    if (first.holds(held)) {  // spares the EEPROM
      ++i;
      continue;
    }
    // Again and again it would only wear the EEPROM.
    if (first.saved && not_held_.contains(first.address)) co_return fail(not_held(first, held));
    auto run = run_of(std::span(required).subspan(i), present);
    i += run.size();
    if (const auto ready = co_await prepare_write(first); !ready) co_return ready;
    if (const auto written = co_await write(first.address, std::move(run)); !written) co_return written;
  }
  co_return Result<void>{};
}

std::vector<DriveSetting> DriveConfiguration::starting_inputs(std::span<const DriveSetting> required,
                                                              const SettingValues& present) const {
  std::vector<DriveSetting> inputs;
  if (!traits_.input_levels) return inputs;
  const auto levels = std::ranges::find(required, *traits_.input_levels, &DriveSetting::address);
  if (levels == required.end()) return inputs;
  const auto turned = static_cast<std::uint32_t>(present.at(levels->address) ^ levels->value);
  for (const auto& input : required) {
    if (!is_input_function(input)) continue;
    const auto function = present.at(input.address);
    const bool changes = function != input.value || (turned & input.input_bits) != 0;
    if (changes && starts_motion(traits_.input_functions, function)) inputs.push_back(input);
  }
  return inputs;
}

Task<Result<void>> DriveConfiguration::neutralise(DriveSetting input) {
  if (const auto switched = co_await save_writes(input.saved, 1); !switched) co_return switched;
  co_return co_await write(input.address, {0});
}

std::vector<std::int64_t> DriveConfiguration::run_of(std::span<const DriveSetting> required,
                                                     const SettingValues& present) const {
  const auto& first = required.front();
  std::vector<std::int64_t> values;
  for (const auto& next : required) {
    if (values.size() == traits_.longest_run) break;
    const bool fits = next.address == first.address + values.size() && next.saved == first.saved &&
                      next.obeys_switch == first.obeys_switch && next.starts_motion == first.starts_motion &&
                      next.input_bits == first.input_bits;
    const auto held = present.find(next.address);
    if (!fits || held == present.end() || next.holds(held->second)) break;
    values.push_back(next.applied_to(held->second));
  }
  return values;
}

/// What can start motion is checked right before it is written; and before the switch of saving is turned,
/// which each further attempt would turn again, and wear.
Task<Result<void>> DriveConfiguration::prepare_write(DriveSetting setting) {
  const bool turns = setting.obeys_switch && saving_ != setting.saved;
  if (setting.starts_motion && turns)
    if (const auto inactive = co_await check_inactive(setting); !inactive) co_return inactive;
  if (turns)
    if (const auto switched = co_await save_writes(setting.saved, 1); !switched) co_return switched;
  if (setting.starts_motion) co_return co_await check_inactive(std::move(setting));
  co_return Result<void>{};
}

Task<Result<void>> DriveConfiguration::check_inactive(DriveSetting setting) {
  const auto activity = co_await memory_->activity();
  if (!activity) co_return fail(activity.error());
  if (activity->enabled || activity->moving || (activity->inputs & setting.input_bits) != 0)
    co_return fail(memory_->error_at(
        Reason::misconfigured, setting.address,
        fmt::format("{} can start motion and is only written while the drive is released and the input "
                    "inactive",
                    setting.key),
        "release the drive and open the input; it is tried again by itself"));
  co_return Result<void>{};
}

Task<Result<void>> DriveConfiguration::save_writes(bool saved, std::uint64_t then) {
  if (!traits_.saving_switch || saving_ == saved) co_return Result<void>{};
  if (saved)
    if (const auto permitted = memory_->permit(1 + then); !permitted) co_return permitted;
  saving_.reset();
  const auto written = co_await memory_->turn_switch(saved);
  if (written || written.error().outcome == Outcome::unknown)
    memory_->count(1);  // whether the switch saves itself is not said: counted
  if (!written) co_return written;
  saving_ = saved;
  co_return Result<void>{};
}

/// How many of these the drive saves as they are written.
std::uint64_t DriveConfiguration::saved_of(std::uint32_t address, std::size_t count) const {
  if (!saves()) return 0;
  std::uint64_t saved = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto* parameter = find_parameter(traits_.parameters, address + i);
    if (parameter != nullptr && parameter->access == Access::rw_saved) ++saved;
  }
  return saved;
}

Task<Result<void>> DriveConfiguration::write(std::uint32_t address, std::vector<std::int64_t> values) {
  const auto saved = saved_of(address, values.size());
  Result<void> written = fail(Reason::internal, "no attempt was made");
  for (int attempt = 0; attempt < traits_.write_attempts; ++attempt) {
    if (saved > 0)
      if (const auto permitted = memory_->permit(1); !permitted) co_return permitted;
    written = co_await memory_->write(address, values);
    const bool executed = written || written.error().outcome == Outcome::unknown;
    if (executed && saved > 0) memory_->count(saved);
    if (written || written.error().reason != Reason::no_reply) break;
  }
  co_return written;
}

Task<Result<std::vector<ParameterValue>>> DriveConfiguration::write_parameters(
    std::vector<ParameterValue> values) {
  std::vector<std::uint32_t> addresses;
  addresses.reserve(values.size());
  for (const auto& value : values) addresses.push_back(value.address);
  const auto before = co_await memory_->read_numbers(addresses);
  if (!before) co_return fail(before.error());
  const auto differs = [&](std::int64_t found, std::int64_t wanted) {
    return ((found ^ wanted) & traits_.value_mask) != 0;
  };
  std::vector<ParameterValue> different;  // the others spare the EEPROM
  for (std::size_t i = 0; i < values.size(); ++i)
    if (differs((*before)[i].value, values[i].value)) different.push_back(values[i]);
  const auto saves = static_cast<std::uint64_t>(
      std::ranges::count_if(different, [&](const auto& value) { return is_saved(value.address); }));
  if (saves > 0)  // all of them or none
    if (const auto permitted = memory_->permit(saves); !permitted) co_return fail(permitted.error());
  for (const auto& value : different)
    if (const auto written = co_await write(value.address, {value.value & traits_.value_mask}); !written)
      co_return fail(written.error());
  auto present = co_await memory_->read_numbers(std::move(addresses));
  if (!present) co_return present;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (const auto found = (*present)[i].value; differs(found, values[i].value))
      co_return fail(
          memory_->error_at(Reason::misconfigured, values[i].address,
                            fmt::format("reads {} after {} was written", found, values[i].value),
                            "check whether another master writes to this drive, or its EEPROM fails"));
  co_return present;
}

Task<Result<void>> DriveConfiguration::write_saved(std::vector<ParameterValue> values) {
  // All of it or nothing: half of it might leave the drive out of reach. Two turn the switch, there and back.
  if (const auto permitted = memory_->permit(values.size() + 2); !permitted) co_return permitted;
  // A drive that was told not to save would have lost it when it counts.
  if (const auto saving = co_await save_writes(true); !saving) co_return saving;
  const auto written = co_await write_parameters(std::move(values));
  const auto restored = co_await leave_switch();
  if (!written) co_return fail(written.error());
  co_return restored;
}

Task<Result<void>> DriveConfiguration::verify(std::vector<DriveSetting> required) {
  const auto after = co_await memory_->read(addresses_of(required), DriveMemory::Moment::after);
  if (!after) co_return fail(after.error());
  for (const auto& setting : required)
    if (const auto actual = after->at(setting.address); !setting.holds(actual)) {
      if (setting.saved) not_held_.insert(setting.address);
      co_return fail(not_held(setting, actual));
    }
  co_return Result<void>{};
}

Error DriveConfiguration::not_held(const DriveSetting& setting, std::int64_t actual) const {
  return memory_->error_at(
      Reason::misconfigured, setting.address,
      fmt::format("{} ({}) reads {} after {} was written", setting.key, memory_->name_of(setting.address),
                  actual, setting.applied_to(actual)),
      "check whether another master writes to this drive, or its EEPROM fails; what is saved is "
      "written again after the drive's next power-up");
}

Drift DriveConfiguration::drift_in(const SettingValues& present) const {
  Drift drift;
  for (const auto& setting : watched_) {
    const auto actual = present.at(setting.address);
    if (setting.holds(actual)) continue;
    drift.text += fmt::format("{}{} ({}) reads {} instead of {}", drift.text.empty() ? "" : "; ", setting.key,
                              memory_->name_of(setting.address), actual, setting.applied_to(actual));
    drift.scale_changed = drift.scale_changed || setting.key == "scale.microstep";
    drift.limits_changed =
        drift.limits_changed || setting.key == "drive.overtravel_stop" || setting.key.starts_with("inputs");
  }
  return drift;
}

}  // namespace axisd
