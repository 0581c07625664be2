#include "devices/yako_rtu/drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "buses/modbus_rtu/node.hpp"
#include "devices/yako_rtu/codec.hpp"
#include "devices/yako_rtu/configuration.hpp"
#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {

namespace {

using modbus_rtu::Answer;

constexpr int chain_attempts = 3;

TransactionOptions in(TransactionClass transaction_class) { return {.transaction_class = transaction_class}; }

/// Adds the vendor's meaning to an exception.
Error explained(Error error) {
  if (error.reason == Reason::refused && error.where.native_code)
    error.message = fmt::format("the drive refused: {} (exception {:02})",
                                exception_text(*error.where.native_code), *error.where.native_code);
  return error;
}

/// One YKD2405PR. Thread: core.
///
/// The canary: registers 0x0020..0x0025 live in RAM. Whatever stands there after a power-up is never what
/// this class last wrote, so one read of the block proves that the drive has not been restarted since (M6,
/// M7).
class YakoRtuDrive final : public Drive {
 public:
  explicit YakoRtuDrive(DriveContext context)
      : clock_(context.clock), node_(*context.rtu, context.node), setup_(std::move(context.setup)) {}

  Task<Result<DriveIdentity>> identify(TransactionClass transaction_class) override;
  Task<Result<void>> configure() override;
  Task<Result<DriveSample>> read_state(TransactionClass transaction_class) override;
  Task<Result<void>> check_continuity(TransactionClass transaction_class) override;
  [[nodiscard]] std::optional<ContinuityMark> continuity_mark() const override {
    return expected_.size() == 1 ? std::optional(expected_.front()) : std::nullopt;
  }
  void expect_mark(const ContinuityMark& mark) override { expected_ = {mark}; }
  Task<Result<void>> enable(MotionGuard guard) override;
  Task<Result<void>> disable(MotionGuard guard) override;
  Task<Result<void>> start_move(MoveProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_velocity(VelocityProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_homing(HomingProfile profile, MotionGuard guard) override;
  Task<Result<void>> stop(StopKind kind) override;
  Task<Result<void>> clear_alarm() override;
  Task<Result<void>> clear_position(MotionGuard guard) override;

 private:
  using Registers = std::map<std::uint16_t, std::uint16_t>;
  struct Trigger {
    std::uint16_t address;
    std::uint16_t value;
  };

  Task<Result<Registers>> read_configuration() const;
  Task<Result<void>> write_configuration(const std::vector<RegisterSetting>& required, Registers present);
  Task<Result<void>> neutralise_inputs(const std::vector<RegisterSetting>& required, Registers& present);
  Task<Result<void>> write_setting(const RegisterSetting& setting);
  Task<Result<void>> set_canary();
  Task<Result<Answer>> read_canary(TransactionOptions options);
  Task<Result<void>> start(MotionBlock block, std::optional<HomingBlock> homing, Trigger trigger,
                           MotionGuard guard);
  Task<Result<void>> start_once(MotionBlock block, std::optional<HomingBlock> homing, Trigger trigger,
                                MotionGuard guard);
  Task<Result<void>> write_canary(MotionBlock block, TransactionOptions options);
  /// Keeps a block off every content that a power-up could leave.
  [[nodiscard]] MotionBlock distinct(MotionBlock block) const;
  [[nodiscard]] std::unexpected<Error> failed(Error error) const { return fail(explained(std::move(error))); }
  [[nodiscard]] Error error_at(Reason reason, std::uint16_t address, std::string message,
                               std::string remedy) const;

  Clock* clock_;
  modbus_rtu::Node node_;
  DriveSetup setup_;
  /// What the motion block may hold: one entry, two after a block write whose reply was lost.
  std::vector<MotionBlock> expected_;
  MotionBlock found_at_connect_ = factory_block;  ///< possibly what a power-up leaves (saved by 0x002B = 2)
};

Error YakoRtuDrive::error_at(Reason reason, std::uint16_t address, std::string message,
                             std::string remedy) const {
  return {.reason = reason,
          .message = std::move(message),
          .remedy = std::move(remedy),
          .outcome = Outcome::not_executed,
          .where = {.bus = node_.bus().settings().name, .node = node_.address(), .object = address}};
}

Task<Result<DriveIdentity>> YakoRtuDrive::identify(TransactionClass transaction_class) {
  const auto answer = co_await node_.read(reg::model, 2, in(transaction_class));
  if (!answer) co_return failed(answer.error());
  const auto code = answer->registers[0];
  const auto version = answer->registers[1];
  const auto setting = setup_.model_settings.find("model_code");
  const auto* wanted =
      setting == setup_.model_settings.end() ? nullptr : std::get_if<std::int64_t>(&setting->second);
  const bool any = wanted == nullptr || *wanted == 0;
  // 6.1 prints both codes and does not say which one is which variant.
  const bool fits = any ? code == 0x0301 || code == 0x0302 : code == *wanted;
  if (!fits)
    co_return fail(
        error_at(Reason::wrong_model, reg::model,
                 fmt::format("a drive with model code 0x{:04X} answers where ykd2405pr ({}) is configured",
                             code, any ? "0x0301 or 0x0302" : fmt::format("0x{:04X}", *wanted)),
                 "correct model or node in the configuration, or the address switches of the drives"));
  co_return DriveIdentity{.model_code = code,
                          .version = fmt::format("V{}.{}", version >> 8U, (version >> 4U) & 0xFU)};
}

Task<Result<DriveSample>> YakoRtuDrive::read_state(TransactionClass transaction_class) {
  const auto answer = co_await node_.read(reg::mode, state_count, in(transaction_class));
  if (!answer) co_return failed(answer.error());
  auto sample = decode_state(answer->registers);
  sample.asked_at = answer->sent_at;
  sample.measured_at = answer->answered_at;
  co_return sample;
}

Task<Result<YakoRtuDrive::Registers>> YakoRtuDrive::read_configuration() const {
  struct Block {
    std::uint16_t address, count;
  };
  // 0x0030 cannot be read, 0x0019 is a hole; at most 16 registers per read (6.2.1).
  static constexpr Block blocks[] = {{reg::current, 9}, {reg::homing_mode, 6}, {reg::input_levels, 16}};
  Registers registers;
  for (const auto& block : blocks) {
    const auto answer =
        co_await node_.read_patiently(block.address, block.count, in(TransactionClass::parameters));
    if (!answer) co_return failed(answer.error());
    for (std::uint16_t i = 0; i < block.count; ++i)
      registers[static_cast<std::uint16_t>(block.address + i)] = answer->registers[i];
  }
  co_return registers;
}

Task<Result<void>> YakoRtuDrive::configure() {
  expected_.clear();
  const auto required = required_registers(setup_);
  if (!required) co_return failed(required.error());
  const auto before = co_await read_configuration();
  if (!before) co_return fail(before.error());
  if (const auto written = co_await write_configuration(*required, *before); !written) co_return written;
  const auto after = co_await read_configuration();
  if (!after) co_return fail(after.error());
  for (const auto& setting : *required) {
    if (const auto actual = after->at(setting.address); actual != setting.value)
      co_return fail(error_at(Reason::misconfigured, setting.address,
                              fmt::format("register 0x{:04X} reads {} after {} was written", setting.address,
                                          actual, setting.value),
                              "check whether another master writes to this drive, or its EEPROM fails"));
  }
  co_return co_await set_canary();
}

Task<Result<void>> YakoRtuDrive::write_configuration(const std::vector<RegisterSetting>& required,
                                                     Registers present) {
  bool neutral = false;
  for (const auto& setting : required) {
    // Before anything else about inputs, but after the EEPROM switch (M3).
    if (setting.address >= reg::input_levels && !std::exchange(neutral, true))
      if (const auto done = co_await neutralise_inputs(required, present); !done) co_return done;
    if (present.at(setting.address) == setting.value) continue;  // spares the EEPROM
    if (const auto written = co_await write_setting(setting); !written) co_return written;
  }
  co_return Result<void>{};
}

/// Takes functions that can start motion off inputs that get another function or level: the new level could
/// act like an edge of the old function.
Task<Result<void>> YakoRtuDrive::neutralise_inputs(const std::vector<RegisterSetting>& required,
                                                   Registers& present) {
  const auto wanted = [&](std::uint16_t address) {
    return std::ranges::find(required, address, &RegisterSetting::address)->value;
  };
  const unsigned turned = present.at(reg::input_levels) ^ wanted(reg::input_levels);
  for (std::uint16_t i = 0; i < input_count; ++i) {
    const auto address = static_cast<std::uint16_t>(reg::first_input_function + i);
    auto& function = present.at(address);
    const bool changes = function != wanted(address) || ((turned >> i) & 1U) != 0;
    if (!changes || !starts_motion(function)) continue;
    const auto written = co_await write_setting({.address = address, .value = 0});
    if (!written) co_return written;
    function = 0;
  }
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::write_setting(const RegisterSetting& setting) {
  if (setting.starts_motion) {
    const auto state = co_await read_state(TransactionClass::parameters);
    if (!state) co_return fail(state.error());
    if (state->enabled || (state->inputs & setting.input_bit) != 0)
      co_return fail(
          error_at(Reason::misconfigured, setting.address,
                   "a terminal function that can start motion is only assigned while the drive is released "
                   "and the input inactive",
                   "release the drive and open the input; it is tried again by itself"));
  }
  const auto written =
      co_await node_.write_patiently(setting.address, setting.value, in(TransactionClass::parameters));
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::set_canary() {
  const auto found = co_await node_.read_patiently(reg::start_speed, 6, in(TransactionClass::parameters));
  if (!found) co_return failed(found.error());
  std::ranges::copy(found->registers, found_at_connect_.begin());
  // Pulses 0: should a terminal start a relative move, it goes nowhere.
  // The deceleration time differs a little each time: a record of an earlier power cycle then never fits this
  // one.
  const auto moment = clock_->now().time_since_epoch() / std::chrono::milliseconds(1);
  const MotionBlock neutral = {5, 100, static_cast<std::uint16_t>(101 + moment % 61), 60, 0, 0};
  co_return co_await write_canary(distinct(neutral), in(TransactionClass::parameters));
}

MotionBlock YakoRtuDrive::distinct(MotionBlock block) const {
  while (block == factory_block || block == found_at_connect_)
    block[1] = block[1] < 2000 ? block[1] + 1 : block[1] - 2;
  return block;
}

Task<Result<void>> YakoRtuDrive::write_canary(MotionBlock block, TransactionOptions options) {
  const auto written = co_await node_.write_block(reg::start_speed, block, std::move(options));
  if (written) {
    expected_ = {block};
    co_return Result<void>{};
  }
  // Without a reply either content may stand there now.
  if (written.error().outcome == Outcome::unknown) expected_.push_back(block);
  co_return failed(written.error());
}

Task<Result<Answer>> YakoRtuDrive::read_canary(TransactionOptions options) {
  auto answer = co_await node_.read(reg::start_speed, 6, std::move(options));
  if (!answer) co_return failed(answer.error());
  MotionBlock block{};
  std::ranges::copy(answer->registers, block.begin());
  if (std::ranges::find(expected_, block) == expected_.end()) {
    expected_.clear();
    co_return fail(error_at(Reason::rebooted, reg::start_speed,
                            "the drive lost its memory: it was switched off and on",
                            "home the axis again, then enable it; nothing resumes by itself"));
  }
  expected_ = {block};
  co_return answer;
}

Task<Result<void>> YakoRtuDrive::check_continuity(TransactionClass transaction_class) {
  const auto answer = co_await read_canary(in(transaction_class));
  if (!answer) co_return fail(answer.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::enable(MotionGuard guard) {
  const auto canary = co_await read_canary({.transaction_class = TransactionClass::motion, .guard = guard});
  if (!canary) co_return fail(canary.error());
  const auto written =
      co_await node_.write(reg::enable, 1, {.transaction_class = TransactionClass::motion, .guard = guard});
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::disable(MotionGuard guard) {
  const auto written = co_await node_.write_patiently(
      reg::enable, 0, {.transaction_class = TransactionClass::stop, .guard = std::move(guard)});
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::start_move(MoveProfile profile, MotionGuard guard) {
  // 7.6.1: bit 0 position mode, bit 2 absolute. An absolute start that arrives twice goes nowhere the second
  // time.
  co_return co_await start(encode(profile), std::nullopt, {reg::start, 5}, std::move(guard));
}

Task<Result<void>> YakoRtuDrive::start_velocity(VelocityProfile profile, MotionGuard guard) {
  co_return co_await start(encode(profile), std::nullopt, {reg::start, 2}, std::move(guard));
}

Task<Result<void>> YakoRtuDrive::start_homing(HomingProfile profile, MotionGuard guard) {
  // Homing uses its own block; the motion block is only the canary, and keeps what it holds.
  if (expected_.empty())
    co_return fail(
        error_at(Reason::configuring, reg::start_speed, "the drive is not configured yet", "wait"));
  co_return co_await start(expected_.back(), encode(profile), {reg::homing_start, 1}, std::move(guard));
}

Task<Result<void>> YakoRtuDrive::start(MotionBlock block, std::optional<HomingBlock> homing, Trigger trigger,
                                       MotionGuard guard) {
  Result<void> result;
  for (int attempt = 0; attempt < chain_attempts; ++attempt) {
    result = co_await start_once(block, homing, trigger, guard);
    if (result) break;
    const auto& error = result.error();
    const bool trigger_sent = error.where.object == trigger.address && error.outcome == Outcome::unknown;
    // The canary had grown too old for the trigger, or a reply was lost before it: the chain begins anew.
    const bool canary_expired = error.reason == Reason::expired && clock_->now() < guard.not_after;
    const bool lost_before_trigger = error.reason == Reason::no_reply && !trigger_sent;
    if (!canary_expired && !lost_before_trigger) break;
  }
  if (!result && result.error().where.object != trigger.address && result.error().outcome == Outcome::unknown)
    result.error().outcome = Outcome::not_executed;  // only parameters were written
  co_return result;
}

Task<Result<void>> YakoRtuDrive::start_once(MotionBlock block, std::optional<HomingBlock> homing,
                                            Trigger trigger, MotionGuard guard) {
  const TransactionOptions motion{.transaction_class = TransactionClass::motion, .guard = guard};
  const auto canary = co_await read_canary(motion);
  if (!canary) co_return fail(canary.error());

  if (homing) {
    const auto written = co_await node_.write_block(reg::homing_mode, *homing, motion);
    if (!written) co_return failed(written.error());
  } else if (const auto written = co_await write_canary(distinct(block), motion); !written) {
    co_return written;
  }

  // A drive that restarts after the canary was read is silent for longer than reboot_guard: a trigger bound
  // within it never meets default parameters.
  auto fresh = motion;
  fresh.guard.not_after = std::min(guard.not_after, canary->sent_at + setup_.reboot_guard);
  const auto triggered = co_await node_.write(trigger.address, trigger.value, fresh);
  if (!triggered) co_return failed(triggered.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::stop(StopKind kind) {
  const std::uint16_t value = kind == StopKind::quick_stop ? 1 : 0;  // 7.6.2: zero is a command
  const auto written = co_await node_.write(reg::stop, value, in(TransactionClass::stop));
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::clear_alarm() {
  const auto written = co_await node_.write_patiently(reg::alarm_clear, 1, in(TransactionClass::parameters));
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::clear_position(MotionGuard guard) {
  const auto written = co_await node_.write(
      reg::position_clear, 1, {.transaction_class = TransactionClass::motion, .guard = std::move(guard)});
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

}  // namespace

std::unique_ptr<Drive> make_drive(DriveContext context) {
  return std::make_unique<YakoRtuDrive>(std::move(context));
}

}  // namespace axisd::yako_rtu
