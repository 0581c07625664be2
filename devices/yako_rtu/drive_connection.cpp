// Identity, state, and the configuration: compare, write what differs, verify.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/rtu_identification.hpp"
#include "devices/setup_codes.hpp"
#include "devices/yako_rtu/drive.hpp"
#include "devices/yako_rtu/register_blocks.hpp"
#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {

namespace {

constexpr std::size_t longest_write = 16;
constexpr int write_attempts = 3;
constexpr std::uint16_t segment_rows = 16;

TransactionOptions in(TransactionClass transaction_class) { return {.transaction_class = transaction_class}; }

/// Pulses per second, whatever the drive is told (M11).
double highest_rate(const Capabilities& capabilities, const DriveSetup& setup) {
  return std::min(static_cast<double>(capabilities.maximum_pulse_rate_hz),
                  static_cast<double>(setup.pulses_per_revolution) * capabilities.maximum_rpm / 60);
}

bool is_input_function(const RegisterSetting& setting) { return setting.key.starts_with("inputs."); }

std::vector<std::uint16_t> addresses_of(const std::vector<RegisterSetting>& settings) {
  std::vector<std::uint16_t> addresses;
  addresses.reserve(settings.size());
  for (const auto& setting : settings) addresses.push_back(setting.address);
  return addresses;
}

}  // namespace

YakoRtuDrive::YakoRtuDrive(const Model& model, DriveContext context)
    : model_(&model),
      clock_(context.clock),
      node_(*context.rtu, context.node),
      setup_(std::move(context.setup)),
      first_input_function_(first_input_function(model, setup_)),
      torn_position_(highest_rate(model.descriptor->capabilities, setup_)) {
  auto required = required_registers(model, setup_);
  if (required)
    required_ = std::move(*required);
  else
    setup_error_ = required.error();
}

std::unexpected<Error> YakoRtuDrive::failed(Error error) const {
  if (error.reason == Reason::refused && error.where.native_code) {
    const auto code = *error.where.native_code;
    error.message = fmt::format("the drive refused: {} (exception {:02})", exception_text(code), code);
    if (error.remedy.empty()) error.remedy = exception_remedy(code);
  }
  return fail(std::move(error));
}

Error YakoRtuDrive::error_at(Reason reason, std::uint16_t address, std::string message,
                             std::string remedy) const {
  return {.reason = reason,
          .message = std::move(message),
          .remedy = std::move(remedy),
          .outcome = Outcome::not_executed,
          .where = {.bus = node_.bus().settings().name, .node = node_.address(), .object = address}};
}

Error YakoRtuDrive::wrong_model(std::uint16_t code, const std::string& found) const {
  return error_at(Reason::wrong_model, reg::model,
                  fmt::format("a drive with model code 0x{:04X} ({}) answers where {} is configured", code,
                              found, model_->descriptor->model),
                  "correct model or node in the configuration, or the address switches of the drives");
}

Task<Result<DriveIdentity>> YakoRtuDrive::identify(TransactionClass transaction_class) {
  const auto& identification = model_->descriptor->identification;
  const auto answer =
      co_await node_.read(identification.read.address, identification.read.count, in(transaction_class));
  if (!answer) co_return failed(answer.error());
  const auto code = answer->registers[0];
  const auto setting = setup_.model_settings.find("model_code");
  const auto* wanted =
      setting == setup_.model_settings.end() ? nullptr : std::get_if<std::int64_t>(&setting->second);
  const bool any = wanted == nullptr || *wanted == 0;
  const auto& codes = identification.model_codes;
  bool fits = any ? std::ranges::find(codes, code) != codes.end() : code == *wanted;
  if (fits) {
    const auto probed = co_await probes_fit(node_, identification, in(transaction_class));
    if (!probed) co_return failed(probed.error());
    fits = *probed;
  }
  if (!fits) {
    auto models = rtu_models_with_code(identification.read, answer->registers);
    const auto found = co_await find_fitting_model(node_, std::move(models), in(transaction_class));
    if (!found) co_return failed(found.error());
    co_return fail(wrong_model(code, *found == nullptr ? "unknown" : std::string((*found)->model)));
  }
  co_return DriveIdentity{.model_code = code, .version = version_text(answer->registers)};
}

bool YakoRtuDrive::closed_loop() const {
  const auto mode = setup_.model_settings.find("loop_mode");
  const bool open = mode != setup_.model_settings.end() && mode->second == SettingValue(std::string("open"));
  // Whether 0x0012 counts at once or from the next power-up is not said: a drive that came up open is open.
  return model_->descriptor->capabilities.closed_loop && !open && found_closed_.value_or(false);
}

/// 0x011F gives no unit: the larger of its readings as counts of the encoder and as pulses.
std::int64_t YakoRtuDrive::position_window() const {
  const auto mode = setup_.model_settings.find("loop_mode");
  const bool open = mode != setup_.model_settings.end() && mode->second == SettingValue(std::string("open"));
  if (!model_->descriptor->capabilities.closed_loop || open || !found_closed_.value_or(true)) return 0;
  const auto in_counts =
      (accuracy_ * setup_.pulses_per_revolution + counts_per_revolution_ - 1) / counts_per_revolution_;
  return std::max(accuracy_, in_counts);
}

void YakoRtuDrive::note_register(std::uint16_t address, std::uint16_t value) {
  if (address == reg::encoder_resolution) counts_per_revolution_ = value == 1 ? 10000 : 4000;
  if (address == reg::positioning_accuracy) accuracy_ = std::max<std::uint16_t>(value, 1);
  if (address == reg::terminal_move_mode) terminal_move_mode_ = value;
}

Task<Result<void>> YakoRtuDrive::read_noted() {
  std::vector<std::uint16_t> noted;
  if (may_start_in_one_frame()) noted.push_back(reg::terminal_move_mode);
  if (model_->descriptor->capabilities.closed_loop)
    noted.insert(noted.end(), {reg::encoder_resolution, reg::positioning_accuracy});
  const auto found = co_await read_registers(std::move(noted), in(TransactionClass::parameters));
  if (!found) co_return fail(found.error());
  for (const auto& [address, value] : *found) note_register(address, value);
  co_return Result<void>{};
}

bool YakoRtuDrive::moves_by_itself() const { return !check_control_mode(); }

DriveSample YakoRtuDrive::sample_of(std::span<const std::uint16_t> registers, TimePoint asked_at,
                                    TimePoint measured_at) {
  auto sample = decode_state(registers);
  sample.asked_at = asked_at;
  sample.measured_at = measured_at;
  sample.mode = mode_.judge(sample);
  torn_position_.believe(sample.position_pulses, asked_at);
  if (rules_out_restart(sample))
    note_proof(asked_at);
  else
    proven_at_.reset();
  return sample;
}

bool YakoRtuDrive::is_suspect(std::span<const std::uint16_t> registers, TimePoint measured_at) const {
  return torn_position_.suspects(decode_state(registers).position_pulses, measured_at);
}

Task<Result<DriveSample>> YakoRtuDrive::read_again(TransactionClass transaction_class, std::int32_t suspect) {
  Result<modbus_rtu::Answer> answer;
  std::int32_t position = suspect;
  // A genuine step stays; that three readings are torn alike is not to be expected.
  for (int again = 0; again < 2; ++again) {
    answer = co_await node_.read(reg::mode, state_count, in(transaction_class));
    if (!answer) co_return failed(answer.error());
    position = TornPosition::of_two(suspect, decode_state(answer->registers).position_pulses);
    if (!torn_position_.suspects(position, answer->answered_at)) break;
  }
  auto& registers = answer->registers;
  const auto words = static_cast<std::uint32_t>(position);
  registers.at(reg::position_high - reg::mode) = static_cast<std::uint16_t>(words >> 16U);
  registers.at(reg::position_low - reg::mode) = static_cast<std::uint16_t>(words & 0xFFFFU);
  co_return sample_of(answer->registers, answer->sent_at, answer->answered_at);
}

Task<Result<DriveSample>> YakoRtuDrive::read_state(TransactionClass transaction_class,
                                                   TimePoint awaited_from) {
  auto options = in(transaction_class);
  options.awaited_from = awaited_from;
  const auto answer = co_await node_.read(reg::mode, state_count, std::move(options));
  if (!answer) co_return failed(answer.error());
  if (is_suspect(answer->registers, answer->answered_at))
    co_return co_await read_again(transaction_class, decode_state(answer->registers).position_pulses);
  co_return sample_of(answer->registers, answer->sent_at, answer->answered_at);
}

Task<Result<std::optional<DriveSample>>> YakoRtuDrive::watch_state(StateWatch watch) {
  modbus_rtu::Repetition repetition{.period = watch.period};
  repetition.goes_on = [this, &watch](const modbus_rtu::Reading& reading) {
    if (is_suspect(reading.registers, reading.answered_at)) return false;
    return watch.goes_on(sample_of(reading.registers, reading.sent_at, reading.answered_at));
  };
  repetition.proof = {.request = node_.reading(reg::start_speed, canary_count),
                      .due = watch.proof_due,
                      .holds = [this, &watch](const modbus_rtu::Reading& reading) {
                        const bool proven = recognise_canary(reading.registers);
                        if (proven) watch.proven(reading.sent_at);
                        return proven;
                      }};
  const auto answer = co_await node_.watch(reg::mode, state_count, std::move(repetition));
  if (!answer) co_return failed(answer.error());
  if (!*answer) co_return std::nullopt;
  if (is_suspect((*answer)->registers, (*answer)->answered_at))
    co_return co_await read_again(TransactionClass::idle_state,
                                  decode_state((*answer)->registers).position_pulses);
  co_return sample_of((*answer)->registers, (*answer)->sent_at, (*answer)->answered_at);
}

bool YakoRtuDrive::readable(std::uint32_t address) const {
  // Where the terminals' functions lie is a matter of reading for one model: the other places are holes.
  if (address >= reg::first_input_function && address < reg::output_levels)
    return address >= first_input_function_ &&
           address < first_input_function_ + model_->descriptor->inputs.size();
  const auto* parameter = find_parameter(model_->descriptor->parameters, address);
  return parameter != nullptr && parameter->access != Access::wo;
}

Task<Result<YakoRtuDrive::Registers>> YakoRtuDrive::read_registers(std::vector<std::uint16_t> addresses,
                                                                   TransactionOptions options) const {
  const auto blocks =
      blocks_of(std::move(addresses), [this](std::uint32_t address) { return readable(address); });
  Registers registers;
  for (const auto& block : blocks) {
    const auto answer = co_await node_.read_patiently(block.address, block.count, options);
    if (!answer) co_return failed(answer.error());
    for (std::uint16_t i = 0; i < block.count; ++i)
      registers[static_cast<std::uint16_t>(block.address + i)] = answer->registers[i];
  }
  co_return registers;
}

Task<Result<void>> YakoRtuDrive::configure() {
  if (setup_error_) co_return failed(*setup_error_);
  // The canary goes first and is read last: a restart in between would undo what was found or written.
  if (const auto marked = co_await replace_canary(fresh_neutral_block()); !marked) co_return marked;
  if (const auto done = co_await bring_to(required_); !done) co_return done;
  if (const auto known = co_await read_noted(); !known) co_return known;
  co_return co_await check_continuity(TransactionClass::parameters);
}

Task<Result<void>> YakoRtuDrive::bring_to(std::vector<RegisterSetting> required) {
  auto addresses = addresses_of(required);
  addresses.push_back(reg::eeprom_update);
  if (model_->descriptor->capabilities.closed_loop) addresses.push_back(reg::loop_mode);
  auto before = co_await read_registers(std::move(addresses), in(TransactionClass::parameters));
  if (!before) co_return fail(before.error());
  saving_ = before->at(reg::eeprom_update) == 0;
  if (const auto mode = before->find(reg::loop_mode);
      model_->descriptor->capabilities.closed_loop && mode != before->end() && !found_closed_)
    found_closed_ = mode->second == 0;
  const auto written = co_await write_all(required, *before);
  // Also after a failure: what is written next must not wear the EEPROM.
  const auto restored = co_await save_writes(saves_at_rest());
  if (!written) co_return written;
  if (!restored) co_return restored;
  co_return co_await verify(required);
}

Task<Result<void>> YakoRtuDrive::write_all(const std::vector<RegisterSetting>& required, Registers& present) {
  if (const auto done = co_await neutralise_inputs(required, present); !done) co_return done;
  if (const auto done = co_await silence_segments(required, present); !done) co_return done;
  co_return co_await write_differences(required, present);
}

/// Speed 0 for every row of the segment table that is about to change: a row that a lost frame leaves half
/// written must not be one that a terminal can start.
Task<Result<void>> YakoRtuDrive::silence_segments(const std::vector<RegisterSetting>& required,
                                                  Registers& present) {
  const auto differs = [&](std::uint16_t address) {
    const auto found = std::ranges::find(required, address, &RegisterSetting::address);
    return found != required.end() && !found->holds(present.at(address));
  };
  const auto enables = segment_enables(*model_, setup_);
  for (std::uint16_t row = 0; row < segment_rows; ++row) {
    const auto at = [row](std::uint16_t first) { return static_cast<std::uint16_t>(first + row); };
    const bool changes = differs(reg::terminal_move_mode) || differs(at(reg::segment_pulses_high)) ||
                         differs(at(reg::segment_pulses_low)) || differs(at(reg::segment_time));
    for (const auto speed : {at(reg::segment_speed), at(reg::segment_pv_speed)}) {
      const auto held = present.find(speed);
      if (!changes || held == present.end() || held->second == 0) continue;
      const RegisterSetting silence{.address = speed,
                                    .key = "segments",
                                    .saved = setup_.persist.segments,
                                    .starts_motion = true,
                                    .input_bits = enables};
      if (const auto ready = co_await prepare_write(silence); !ready) co_return ready;
      if (const auto written = co_await write_run(speed, {0}); !written) co_return written;
      held->second = 0;
    }
  }
  co_return Result<void>{};
}

bool YakoRtuDrive::saves_at_rest() const { return setup_.persist == PersistSettings::all(); }

Task<Result<void>> YakoRtuDrive::save_writes(bool saved, std::uint64_t then) {
  if (saving_ == saved) co_return Result<void>{};
  if (saved)
    if (const auto permitted = permit_saves(1 + then); !permitted) co_return permitted;
  const std::uint16_t value = saved ? 0 : 1;
  const auto written =
      co_await node_.write_patiently(reg::eeprom_update, value, in(TransactionClass::parameters));
  saving_.reset();
  if (written || written.error().outcome == Outcome::unknown)
    count_save(1);  // whether this register saves itself is not said: counted
  if (!written) co_return failed(written.error());
  saving_ = saved;
  co_return Result<void>{};
}

/// What can start motion is checked right before it is written; and before the switch of saving is turned,
/// which each further attempt would turn again, and wear.
Task<Result<void>> YakoRtuDrive::prepare_write(const RegisterSetting& setting) {
  if (setting.starts_motion && saving_ != setting.saved)
    if (const auto inactive = co_await check_inactive(setting); !inactive) co_return inactive;
  if (const auto switched = co_await save_writes(setting.saved, 1); !switched) co_return switched;
  if (setting.starts_motion) co_return co_await check_inactive(setting);
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::write_differences(const std::vector<RegisterSetting>& required,
                                                   Registers& present) {
  for (std::size_t i = 0; i < required.size();) {
    const auto& first = required[i];
    if (first.holds(present.at(first.address))) {  // spares the EEPROM
      ++i;
      continue;
    }
    std::vector<std::uint16_t> values;
    while (i < required.size() && values.size() < longest_write) {
      const auto& next = required[i];
      const bool fits = next.address == first.address + values.size() && next.saved == first.saved &&
                        next.starts_motion == first.starts_motion && next.input_bits == first.input_bits;
      if (!fits || next.holds(present.at(next.address))) break;
      values.push_back(next.applied_to(present.at(next.address)));
      ++i;
    }
    // Again and again it would only wear the EEPROM.
    if (first.saved && unsaved_.contains(first.address))
      co_return fail(not_held(first, present.at(first.address)));
    if (const auto ready = co_await prepare_write(first); !ready) co_return ready;
    if (const auto written = co_await write_run(first.address, std::move(values)); !written)
      co_return written;
  }
  co_return Result<void>{};
}

/// How many of these registers the drive saves as they are written.
std::uint64_t YakoRtuDrive::saved_registers(std::uint16_t first, std::size_t count) const {
  std::uint64_t saved = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto* parameter = find_parameter(model_->descriptor->parameters, first + i);
    if (parameter != nullptr && parameter->access == Access::rw_saved) ++saved;
  }
  return saved;
}

Task<Result<void>> YakoRtuDrive::write_run(std::uint16_t address, std::vector<std::uint16_t> values) {
  proven_at_.reset();
  if (address <= reg::terminal_move_mode && address + values.size() > reg::terminal_move_mode)
    terminal_move_mode_.reset();  // until it was read again
  const auto saved = saving_.value_or(true) ? saved_registers(address, values.size()) : 0;
  Result<Answer> written = fail(Reason::internal, "no attempt was made");
  for (int attempt = 0; attempt < write_attempts; ++attempt) {
    if (saved > 0)
      if (const auto permitted = permit_saves(1); !permitted) co_return permitted;
    written = values.size() == 1
                  ? co_await node_.write(address, values.front(), in(TransactionClass::parameters))
                  : co_await node_.write_block(address, values, in(TransactionClass::parameters));
    const bool executed = written || written.error().outcome == Outcome::unknown;
    if (executed && saved > 0) count_save(saved);
    if (written || written.error().reason != Reason::no_reply) break;
  }
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Error YakoRtuDrive::not_held(const RegisterSetting& setting, std::uint16_t actual) const {
  return error_at(Reason::misconfigured, setting.address,
                  fmt::format("register 0x{:04X} ({}) reads {} after {} was written", setting.address,
                              setting.key, actual, setting.applied_to(actual)),
                  "check whether another master writes to this drive, or its EEPROM fails; what is saved is "
                  "written again after the drive's next power-up");
}

Task<Result<void>> YakoRtuDrive::verify(const std::vector<RegisterSetting>& required) {
  const auto after = co_await read_registers(addresses_of(required), in(TransactionClass::parameters));
  if (!after) co_return fail(after.error());
  for (const auto& [address, value] : *after) note_register(address, value);
  for (const auto& setting : required)
    if (const auto actual = after->at(setting.address); !setting.holds(actual)) {
      if (setting.saved) unsaved_.insert(setting.address);
      co_return fail(not_held(setting, actual));
    }
  co_return Result<void>{};
}

/// Takes functions that can start motion off inputs that get another function or level: the new level could
/// act like an edge of the old function.
Task<Result<void>> YakoRtuDrive::neutralise_inputs(const std::vector<RegisterSetting>& required,
                                                   Registers& present) {
  const auto levels = std::ranges::find(required, reg::input_levels, &RegisterSetting::address);
  if (levels == required.end()) co_return Result<void>{};
  const unsigned turned = present.at(reg::input_levels) ^ levels->value;
  for (const auto& input : required) {
    if (!is_input_function(input)) continue;
    auto& function = present.at(input.address);
    const bool changes = function != input.value || (turned & input.input_bits) != 0;
    if (!changes || !starts_motion(model_->descriptor->input_functions, function)) continue;
    if (const auto switched = co_await save_writes(input.saved, 1); !switched) co_return switched;
    if (const auto written = co_await write_run(input.address, {0}); !written) co_return written;
    function = 0;
  }
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::check_inactive(const RegisterSetting& setting) const {
  const auto answer = co_await node_.read(reg::mode, state_count, in(TransactionClass::parameters));
  if (!answer) co_return failed(answer.error());
  const auto state = decode_state(answer->registers);
  if (state.enabled || state.moving || (state.inputs & setting.input_bits) != 0)
    co_return fail(error_at(
        Reason::misconfigured, setting.address,
        fmt::format("{} can start motion and is only written while the drive is released and the input "
                    "inactive",
                    setting.key),
        "release the drive and open the input; it is tried again by itself"));
  co_return Result<void>{};
}

Task<Result<Drift>> YakoRtuDrive::check_drift(TransactionOptions options) {
  // Homing's block is compared before each homing, the performance group moves nothing.
  std::vector<RegisterSetting> watched{{.address = reg::eeprom_update,
                                        .value = static_cast<std::uint16_t>(saves_at_rest() ? 0 : 1),
                                        .key = "persist"}};
  for (const auto& setting : required_)
    if (setting.address < reg::homing_start ||
        (setting.address >= reg::input_levels && setting.address < reg::performance))
      watched.push_back(setting);
  const auto present = co_await read_registers(addresses_of(watched), std::move(options));
  if (!present) co_return fail(present.error());
  Drift drift;
  for (const auto& setting : watched) {
    const auto actual = present->at(setting.address);
    if (setting.holds(actual)) continue;
    drift.text +=
        fmt::format("{}{} (register 0x{:04X}) reads {} instead of {}", drift.text.empty() ? "" : "; ",
                    setting.key, setting.address, actual, setting.applied_to(actual));
    drift.scale_changed = drift.scale_changed || setting.address == reg::microstep;
    drift.limits_changed = drift.limits_changed || setting.address == reg::overtravel_stop ||
                           setting.address == reg::input_levels || is_input_function(setting);
  }
  co_return drift;
}

std::unique_ptr<Drive> make_drive(const Model& model, DriveContext context) {
  return std::make_unique<YakoRtuDrive>(model, std::move(context));
}

}  // namespace axisd::yako_rtu
