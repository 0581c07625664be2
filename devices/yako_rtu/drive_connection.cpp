// Identity, state, and what bring-up does beside the configuration.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/rtu_identification.hpp"
#include "devices/yako_rtu/drive.hpp"
#include "devices/yako_rtu/register_blocks.hpp"
#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {

namespace {

TransactionOptions in(TransactionClass transaction_class) { return {.transaction_class = transaction_class}; }

/// Pulses per second, whatever the drive is told (M11).
double highest_rate(const Capabilities& capabilities, const DriveSetup& setup) {
  return std::min(static_cast<double>(capabilities.maximum_pulse_rate_hz),
                  static_cast<double>(setup.pulses_per_revolution) * capabilities.maximum_rpm / 60);
}

}  // namespace

YakoRtuDrive::YakoRtuDrive(const Model& model, DriveContext context)
    : Drive({.parameters = this,
             .segments = this,
             .memory = this,
             .serial = this,
             .loading = this,
             .drift = this,
             .repeated_watch = this,
             .marks = this,
             .proof = this,
             .stops = this}),
      model_(&model),
      clock_(context.clock),
      node_(*context.rtu, context.node),
      setup_(std::move(context.setup)),
      first_input_function_(first_input_function(model, setup_)),
      configuration_(make_memory(), memory_traits(), required_registers(model, setup_)),
      torn_position_(highest_rate(model.descriptor->capabilities, setup_)) {}

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
  if (configuration_.error()) co_return failed(*configuration_.error());
  // The canary goes first and is read last: a restart in between would undo what was found or written.
  if (const auto marked = co_await replace_canary(fresh_neutral_block()); !marked) co_return marked;
  if (const auto done = co_await configuration_.apply(); !done) co_return done;
  if (const auto known = co_await read_noted(); !known) co_return known;
  co_return co_await check_continuity(TransactionClass::parameters);
}

std::unique_ptr<Drive> make_drive(const Model& model, DriveContext context) {
  return std::make_unique<YakoRtuDrive>(model, std::move(context));
}

}  // namespace axisd::yako_rtu
