// Power, starts and stops, and the canary that every start depends on.
#include <algorithm>
#include <cstdlib>
#include <utility>
#include <vector>

#include "devices/yako_rtu/drive.hpp"
#include "devices/yako_rtu/registers.hpp"
#include "devices/yako_rtu/transactions.hpp"

namespace axisd::yako_rtu {

namespace {

constexpr int chain_attempts = 3;
constexpr int stop_attempts = 3;

TransactionOptions in(TransactionClass transaction_class) { return {.transaction_class = transaction_class}; }

}  // namespace

MotionBlock YakoRtuDrive::fresh_neutral_block() const {
  // Pulses 0: should a terminal start a relative move, it goes nowhere.
  // The deceleration time differs a little each time: a record of an earlier power cycle then never fits this
  // one.
  const auto moment = clock_->now().time_since_epoch() / std::chrono::milliseconds(1);
  return {5, 100, static_cast<std::uint16_t>(101 + moment % 61), 60, 0, 0};
}

void YakoRtuDrive::forget_power_cycle(const MotionBlock& block) {
  canary_.forget();
  proven_at_.reset();
  canary_.note_power_up(block);
  torn_position_.forget();
  found_closed_.reset();
  configuration_.forget_power_cycle();
}

Error YakoRtuDrive::lost_memory(const MotionBlock& found) const {
  const std::string remedy = "enable the axis again, then home it; nothing resumes by itself";
  if (canary_.is_left_by_power_up(found))
    return error_at(Reason::rebooted, reg::start_speed,
                    "the drive lost its memory: it was switched off and on", remedy);
  return error_at(
      Reason::rebooted, reg::start_speed,
      "the drive does not hold the motion parameters that were written last: another master wrote "
      "them, or it was switched off and on",
      "check for other masters on the bus, and the drive's supply; " + remedy);
}

MotionBlock YakoRtuDrive::distinct(const MotionBlock& block) const {
  constexpr std::size_t acceleration_time = 1;
  return canary_.distinct(block, acceleration_time);
}

Task<Result<void>> YakoRtuDrive::write_canary(MotionBlock block, TransactionOptions options) {
  const auto written = co_await node_.write_block(reg::start_speed, block, std::move(options));
  if (written) {
    canary_.written(block);
    co_return Result<void>{};
  }
  if (written.error().outcome == Outcome::unknown) canary_.may_hold(block);
  co_return failed(written.error());
}

/// Whatever asks for this: a restart that nobody had noticed must not be overwritten. So the new one is
/// written soon after the old one was read, as in start_once(), and with the class that can be soon.
Task<Result<void>> YakoRtuDrive::replace_canary(MotionBlock block) {
  proven_at_.reset();
  for (int attempt = 1;; ++attempt) {
    const auto found =
        co_await node_.read_patiently(reg::start_speed, canary_count, in(TransactionClass::motion));
    if (!found) co_return failed(found.error());
    MotionBlock present{};
    std::ranges::copy(found->registers, present.begin());
    const bool known = canary_.is_expected(present);
    const bool restarted = !known && !canary_.blocks().empty();
    auto lost = lost_memory(present);
    if (!known) forget_power_cycle(present);
    if (restarted) co_return fail(std::move(lost));
    auto fresh = in(TransactionClass::motion);
    fresh.deadline = found->sent_at + setup_.reboot_guard;
    auto written = co_await write_canary(distinct(block), fresh);
    const bool grown_old = !written && written.error().reason == Reason::expired;
    if (!grown_old || attempt == chain_attempts) co_return written;
  }
}

Task<Result<modbus_rtu::Answer>> YakoRtuDrive::read_canary(TransactionOptions options) {
  auto answer = co_await node_.read(reg::start_speed, canary_count, std::move(options));
  if (!answer) co_return failed(answer.error());
  if (!recognise_canary(answer->registers)) {
    MotionBlock found{};
    std::ranges::copy(answer->registers, found.begin());
    auto lost = lost_memory(found);
    forget_power_cycle(found);
    co_return fail(std::move(lost));
  }
  note_proof(answer->sent_at);
  co_return answer;
}

/// What stands where the canary does may be it; then it is known from now on which.
bool YakoRtuDrive::recognise_canary(std::span<const std::uint16_t> registers) {
  MotionBlock found{};
  std::ranges::copy(registers, found.begin());
  if (!canary_.is_expected(found)) return false;
  canary_.found(found);
  return true;
}

bool YakoRtuDrive::is_started_by_terminals() const {
  return std::ranges::any_of(setup_.inputs, [this](const TerminalSettings& input) {
    const auto* function = find_function(model_->descriptor->input_functions, input.function);
    return function != nullptr && function->starts_motion;
  });
}

/// Where it rests just where the block in its memory sent it, too: a released shaft may have been turned off
/// 0 by hand since a restart, but hardly to there. A terminal may well have sent it there again.
bool YakoRtuDrive::rules_out_restart(const DriveSample& sample) const {
  if (!canary_.is_known() || is_started_by_terminals() || !counts_on(sample)) return false;
  return std::abs(target_of(canary_.blocks().front()) - sample.position_pulses) <= position_window();
}

void YakoRtuDrive::note_proof(TimePoint asked_at) {
  if (!proven_at_ || *proven_at_ < asked_at) proven_at_ = asked_at;
}

/// A proof that stands for the canary of a start (M6): nothing has happened to the node since, and what is
/// left of reboot_guard is enough for the block, also where the line has something else to do before the
/// trigger, a reading at most. The gate judges its age again when that is bound.
std::optional<TimePoint> YakoRtuDrive::fresh_proof() const {
  if (!proven_at_ || *proven_at_ <= node_.bus().disturbed_at(node_.address())) return std::nullopt;
  const auto& line = node_.bus().settings();
  const auto size = writing(canary_count);
  const auto block =
      2 * modbus_rtu::silence(line) + modbus_rtu::wire_time(line, std::size_t{size.request} + size.reply);
  const auto left = std::max<Duration>(setup_.reboot_guard / 4, 2 * block + setup_.reboot_guard / 12);
  return clock_->now() + left <= *proven_at_ + setup_.reboot_guard ? proven_at_ : std::nullopt;
}

std::vector<ContinuityMark> YakoRtuDrive::marks_until(const MotionBlock& block) const {
  std::vector<ContinuityMark> marks;
  for (const auto& present : canary_.blocks()) marks.push_back(mark_of(present));
  marks.push_back(mark_of(distinct(block)));
  return marks;
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
  proven_at_.reset();  // nothing holds the shaft where it was read
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
  if (canary_.blocks().empty())
    co_return fail(
        error_at(Reason::configuring, reg::start_speed, "the drive is not configured yet", "wait"));
  co_return co_await start(canary_.blocks().back(), encode(profile), {reg::homing_start, 1},
                           std::move(guard));
}

Result<void> YakoRtuDrive::check_control_mode() const {
  const auto setting = setup_.model_settings.find("control_mode");
  const auto* mode =
      setting == setup_.model_settings.end() ? nullptr : std::get_if<std::string>(&setting->second);
  if (mode == nullptr || *mode == "bus") return {};
  return fail(error_at(Reason::not_supported, reg::control_mode,
                       "the drive takes its motion from pulse inputs (drive.control_mode: " + *mode + ")",
                       "set drive.control_mode to bus, and switch the drive off and on"));
}

Task<Result<void>> YakoRtuDrive::start(MotionBlock block, std::optional<HomingBlock> homing, Trigger trigger,
                                       MotionGuard guard) {
  auto result = check_control_mode();
  if (!result) co_return result;
  for (int attempt = 0; attempt < chain_attempts; ++attempt) {
    // Homing, and what did not work the first time, begin with the canary.
    const auto proven = attempt == 0 && !homing ? fresh_proof() : std::nullopt;
    result = co_await start_once(block, homing, trigger, guard, proven);
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

/// `proven`: what stands for the canary.
Task<Result<void>> YakoRtuDrive::start_once(MotionBlock block, std::optional<HomingBlock> homing,
                                            Trigger trigger, MotionGuard guard,
                                            std::optional<TimePoint> proven) {
  const TransactionOptions motion{.transaction_class = TransactionClass::motion, .guard = guard};
  if (!proven) {
    const auto canary = co_await read_canary(motion);
    if (!canary) co_return fail(canary.error());
    proven = canary->sent_at;
  }
  // A drive that restarts after that was asked for is silent for longer than reboot_guard: a trigger bound
  // within it never meets default parameters, and a block never hides a restart as the next canary.
  auto fresh = motion;
  fresh.guard.not_after = std::min(guard.not_after, *proven + setup_.reboot_guard);
  if (homing) {
    if (const auto prepared = co_await prepare_homing(*homing, fresh); !prepared) co_return prepared;
  } else if (terminal_move_mode_ && may_start_in_one_frame()) {
    co_return co_await start_in_one_frame(distinct(block), trigger, std::move(fresh));
  } else if (const auto written = co_await write_canary(distinct(block), fresh); !written) {
    co_return written;
  }
  const auto triggered = co_await node_.write(trigger.address, trigger.value, fresh);
  if (!triggered) co_return failed(triggered.error());
  co_return Result<void>{};
}

/// Not where a terminal may start what 0x0026 decides: somebody else may have changed that since it was read,
/// and it would be written back.
bool YakoRtuDrive::may_start_in_one_frame() const {
  const auto setting = setup_.model_settings.find("start_in_one_frame");
  const bool wanted = setting != setup_.model_settings.end() && setting->second == SettingValue(true);
  return wanted && !is_started_by_terminals();
}

/// Whatever becomes of the frame is what becomes of the trigger: the error names that, and where it may have
/// arrived it is never sent again (M8). Precondition: 0x0026, which lies between the two, is known.
Task<Result<void>> YakoRtuDrive::start_in_one_frame(MotionBlock block, Trigger trigger,
                                                    TransactionOptions options) {
  static_assert(reg::terminal_move_mode == reg::start_speed + canary_count &&
                reg::start == reg::terminal_move_mode + 1);
  std::vector<std::uint16_t> frame(block.begin(), block.end());
  frame.push_back(*terminal_move_mode_);  // as it stands there
  frame.push_back(trigger.value);
  const auto written = co_await node_.write_block(reg::start_speed, frame, std::move(options));
  if (written) {
    canary_.written(block);
    co_return Result<void>{};
  }
  auto error = written.error();
  const bool refused = error.outcome == Outcome::refused;
  if (refused || error.outcome == Outcome::unknown) canary_.may_hold(block);
  error.where.object = trigger.address;
  if (refused) {
    // Refused for one register, the others may have been taken, the trigger among them.
    error.outcome = Outcome::unknown;
    error.remedy = "if the drive takes no start in one frame, remove drive.start_in_one_frame";
  }
  co_return failed(std::move(error));
}

/// The block of homing is compared and not just written: with `persist` each write wears the EEPROM.
Task<Result<void>> YakoRtuDrive::prepare_homing(HomingBlock block, TransactionOptions options) {
  const auto present = co_await node_.read(reg::homing_mode, 6, options);
  if (!present) co_return failed(present.error());
  if (std::ranges::equal(present->registers, block)) co_return Result<void>{};
  const bool saved = configuration_.saves();
  if (saved)
    if (const auto permitted = permit_saves(1); !permitted) co_return permitted;
  const auto written = co_await node_.write_block(reg::homing_mode, block, std::move(options));
  const bool executed = written || written.error().outcome == Outcome::unknown;
  if (executed && saved) count_save(block.size());
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::stop(StopKind kind) { return send_stop(kind, false); }

Task<Result<void>> YakoRtuDrive::repeat_stop() { return send_stop(StopKind::stop, true); }

Task<Result<void>> YakoRtuDrive::send_stop(StopKind kind, bool patient) {
  const std::uint16_t value = kind == StopKind::quick_stop ? 1 : 0;  // 7.6.2: zero is a command
  for (int attempt = 1;; ++attempt) {
    const auto written = co_await node_.write(
        reg::stop, value, {.transaction_class = TransactionClass::stop, .patient = patient});
    if (written) {
      if (written->certain) co_return Result<void>{};
      // After the reply to a read no older one can follow: the next echo is its own.
      const auto read = co_await node_.read(reg::moving, 1, {.transaction_class = TransactionClass::motion});
      if (read) continue;
      // Whatever is wrong with the reading: it is no refusal of the stop, which may not have been heard.
      auto unheard = read.error();
      unheard.reason = Reason::no_reply;
      unheard.outcome = Outcome::unknown;
      co_return failed(std::move(unheard));
    }
    // A refusal mostly means that the frame was damaged (01, which some firmware answers): at once again.
    if (written.error().reason != Reason::refused || attempt == stop_attempts)
      co_return failed(written.error());
  }
}

Task<Result<void>> YakoRtuDrive::clear_alarm(MotionGuard guard) {
  const auto written = co_await node_.write_patiently(
      reg::alarm_clear, 1, {.transaction_class = TransactionClass::parameters, .guard = std::move(guard)});
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> YakoRtuDrive::clear_position(MotionGuard guard) {
  const auto written = co_await node_.write(
      reg::position_clear, 1, {.transaction_class = TransactionClass::motion, .guard = std::move(guard)});
  torn_position_.forget();
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

}  // namespace axisd::yako_rtu
