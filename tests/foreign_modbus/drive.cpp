#include "tests/foreign_modbus/drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/setup_codes.hpp"
#include "tests/foreign_modbus/registers.hpp"

namespace axisd::acme_s1 {

namespace {

constexpr int attempts = 3;

TransactionOptions in(TransactionClass transaction_class) { return {.transaction_class = transaction_class}; }

std::uint16_t low(std::int32_t value) {
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(value));
}
std::uint16_t high(std::int32_t value) {
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(value) >> 16U);
}
std::uint16_t milliseconds_of(Duration time) {
  return static_cast<std::uint16_t>(time / std::chrono::milliseconds(1));
}
std::uint16_t velocity_of(int rpm) { return low(rpm * counts_per_rpm); }

DriveSample decode(std::span<const std::uint16_t> registers) {
  const auto at = [&](std::uint16_t address) { return registers[address - reg::state]; };
  const auto bits = at(reg::state);
  DriveSample sample;
  sample.mode = at(reg::mode) == mode::homing ? DriveMode::homing : DriveMode::positioning;
  sample.moving = (bits & status::running) != 0;
  sample.in_position = (bits & status::at_target) != 0;
  sample.homed = (bits & status::referenced) != 0;
  sample.enabled = (bits & status::powered) != 0;
  sample.alarm_code = at(reg::fault);
  sample.position_pulses =
      static_cast<std::int32_t>(std::uint32_t{at(reg::position_high)} << 16U | at(reg::position_low));
  sample.velocity_rpm = static_cast<std::int16_t>(at(reg::velocity)) / counts_per_rpm;
  sample.negative_direction = sample.velocity_rpm < 0;
  sample.inputs = at(reg::inputs);
  return sample;
}

}  // namespace

ServoDrive::ServoDrive(DriveContext context)
    : Drive({.marks = this}),
      clock_(context.clock),
      node_(*context.rtu, context.node),
      setup_(std::move(context.setup)) {
  const auto* descriptor = find_drive_model("acme-s1");
  const auto assigned = assign_terminals(setup_.inputs, descriptor->inputs, descriptor->input_functions);
  if (!assigned) {
    setup_error_ = assigned.error();
    return;
  }
  wanted_ = {{reg::counts, low(static_cast<std::int32_t>(setup_.pulses_per_revolution)), "scale"}};
  for (std::size_t i = 0; i < assigned->functions.size(); ++i) {
    const auto* one = assigned->functions[i];
    auto code = one == nullptr ? function::none : one->code;
    // A drive's input is active at a high level; `levels` has a bit for each that is active at a low one.
    if ((assigned->levels >> i & 1U) != 0) code |= function::active_low;
    wanted_.push_back({static_cast<std::uint16_t>(reg::first_input + i), code,
                       fmt::format("inputs.{}", descriptor->inputs[i].name)});
  }
}

std::unexpected<Error> ServoDrive::failed(Error error) const {
  if (error.reason == Reason::refused && error.where.native_code)
    error.message = fmt::format("the drive refused (exception {:02X}h)", *error.where.native_code);
  return fail(std::move(error));
}

Error ServoDrive::error_at(Reason reason, std::uint16_t address, std::string message,
                           std::string remedy) const {
  return {.reason = reason,
          .message = std::move(message),
          .remedy = std::move(remedy),
          .outcome = Outcome::not_executed,
          .where = {.bus = node_.bus().settings().name, .node = node_.address(), .object = address}};
}

Error ServoDrive::lost_memory() const {
  return error_at(Reason::rebooted, reg::tag, "the drive lost its memory: it was switched off and on",
                  "enable the axis again, then home it; nothing resumes by itself");
}

Task<Result<DriveIdentity>> ServoDrive::identify(TransactionClass transaction_class) {
  const auto& by = find_drive_model("acme-s1")->identification;
  const auto answer = co_await node_.read(by.read.address, by.read.count, in(transaction_class));
  if (!answer && answer.error().reason != Reason::refused) co_return failed(answer.error());
  if (!answer || answer->registers[by.code_at] != model_code)
    co_return fail(error_at(Reason::wrong_model, reg::identity, "another drive answers than an ACME S1",
                            "correct model or node in the configuration"));
  co_return DriveIdentity{.model_code = model_code, .version = by.version(answer->registers)};
}

Task<Result<std::vector<std::uint16_t>>> ServoDrive::read_settings(TransactionOptions options) const {
  const auto answer = co_await node_.read_patiently(reg::counts, static_cast<std::uint16_t>(wanted_.size()),
                                                    std::move(options));
  if (!answer) co_return failed(answer.error());
  co_return answer->registers;
}

Task<Result<void>> ServoDrive::configure() {
  if (setup_error_) co_return failed(*setup_error_);
  if (const auto marked = co_await write_tag(); !marked) co_return marked;
  const auto present = co_await read_settings(in(TransactionClass::parameters));
  if (!present) co_return fail(present.error());
  for (std::size_t i = 0; i < wanted_.size(); ++i) {
    if (present->at(i) == wanted_[i].value) continue;
    if (const auto permitted = permit_saves(1); !permitted) co_return permitted;
    const auto written = co_await node_.write_patiently(wanted_[i].address, wanted_[i].value,
                                                        in(TransactionClass::parameters));
    if (written || written.error().outcome == Outcome::unknown) count_save(1);
    if (!written) co_return failed(written.error());
  }
  const auto after = co_await read_settings(in(TransactionClass::parameters));
  if (!after) co_return fail(after.error());
  for (std::size_t i = 0; i < wanted_.size(); ++i)
    if (after->at(i) != wanted_[i].value)
      co_return fail(error_at(Reason::misconfigured, wanted_[i].address,
                              fmt::format("{} is not as it was written", wanted_[i].key),
                              "check whether another master writes to this drive"));
  co_return co_await check_continuity(TransactionClass::parameters);
}

/// A restart that nobody had noticed must not be overwritten: the old tag is read just before.
Task<Result<void>> ServoDrive::write_tag() {
  for (int attempt = 1;; ++attempt) {
    const auto found = co_await node_.read_patiently(reg::tag, tag_count, in(TransactionClass::motion));
    if (!found) co_return failed(found.error());
    const Tag present{found->registers[0], found->registers[1]};
    if (!canary_.is_expected(present)) {
      const bool restarted = !canary_.blocks().empty();
      canary_.forget();
      if (restarted) co_return fail(lost_memory());
    }
    const auto moment = clock_->now().time_since_epoch() / std::chrono::milliseconds(1);
    const Tag fresh{static_cast<std::uint16_t>(moment | 1), static_cast<std::uint16_t>(moment >> 16)};
    auto options = in(TransactionClass::motion);
    options.deadline = found->sent_at + setup_.reboot_guard;
    const auto written = co_await node_.write_block(reg::tag, fresh, std::move(options));
    if (written) {
      canary_.written(fresh);
      co_return Result<void>{};
    }
    if (written.error().outcome == Outcome::unknown) canary_.may_hold(fresh);
    if (written.error().reason != Reason::expired || attempt == attempts) co_return failed(written.error());
  }
}

Task<Result<TimePoint>> ServoDrive::read_tag(TransactionOptions options) {
  const auto answer = co_await node_.read(reg::tag, tag_count, std::move(options));
  if (!answer) co_return failed(answer.error());
  const Tag present{answer->registers[0], answer->registers[1]};
  if (!canary_.is_expected(present)) {
    canary_.forget();
    co_return fail(lost_memory());
  }
  canary_.found(present);
  co_return answer->sent_at;
}

Task<Result<void>> ServoDrive::check_continuity(TransactionClass transaction_class) {
  const auto read = co_await read_tag(in(transaction_class));
  if (!read) co_return fail(read.error());
  co_return Result<void>{};
}

std::optional<ContinuityMark> ServoDrive::continuity_mark() const {
  if (!canary_.is_known()) return std::nullopt;
  const auto& tag = canary_.blocks().front();
  return ContinuityMark(tag.begin(), tag.end());
}

void ServoDrive::expect_marks(const std::vector<ContinuityMark>& marks) {
  std::vector<Tag> tags;
  for (const auto& mark : marks)
    if (mark.size() == tag_count) tags.push_back({mark[0], mark[1]});
  canary_.expect(std::move(tags));
}

/// No start changes the tag.
std::vector<ContinuityMark> ServoDrive::marks_until(const MoveProfile& /*start*/) const {
  const auto mark = continuity_mark();
  return mark ? std::vector<ContinuityMark>{*mark} : std::vector<ContinuityMark>{};
}

std::vector<ContinuityMark> ServoDrive::marks_until(const VelocityProfile& /*start*/) const {
  return marks_until(MoveProfile{});
}

Task<Result<DriveSample>> ServoDrive::read_state(TransactionClass transaction_class, TimePoint awaited_from) {
  auto options = in(transaction_class);
  options.awaited_from = awaited_from;
  const auto answer = co_await node_.read(reg::state, state_count, std::move(options));
  if (!answer) co_return failed(answer.error());
  auto sample = decode(answer->registers);
  sample.asked_at = answer->sent_at;
  sample.measured_at = answer->answered_at;
  co_return sample;
}

Task<Result<void>> ServoDrive::enable(MotionGuard guard) {
  const TransactionOptions motion{.transaction_class = TransactionClass::motion, .guard = guard};
  if (const auto tag = co_await read_tag(motion); !tag) co_return fail(tag.error());
  const auto written = co_await node_.write(reg::power, power::on, motion);
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> ServoDrive::disable(MotionGuard guard) {
  const auto written = co_await node_.write_patiently(
      reg::power, power::off, {.transaction_class = TransactionClass::stop, .guard = std::move(guard)});
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> ServoDrive::start_move(MoveProfile profile, MotionGuard guard) {
  Start one{
      .first = reg::target_low,
      .block = {low(profile.target_pulses), high(profile.target_pulses), velocity_of(profile.velocity_rpm),
                milliseconds_of(profile.acceleration_time), milliseconds_of(profile.deceleration_time)},
      .command = command::move};
  co_return co_await start(std::move(one), std::move(guard));
}

Task<Result<void>> ServoDrive::start_velocity(VelocityProfile profile, MotionGuard guard) {
  Start one{.first = reg::target_low,
            .block = {0, 0, velocity_of(profile.velocity_rpm), milliseconds_of(profile.acceleration_time),
                      milliseconds_of(profile.deceleration_time)},
            .command = command::turn};
  co_return co_await start(std::move(one), std::move(guard));
}

Task<Result<void>> ServoDrive::start_homing(HomingProfile profile, MotionGuard guard) {
  const bool positive = profile.method == HomingMethod::home_positive;
  if (!positive && profile.method != HomingMethod::home_negative)
    co_return fail(error_at(Reason::not_supported, reg::homing_method,
                            "the drive homes to a home switch only", "use home_positive or home_negative"));
  Start one{
      .first = reg::homing_method,
      .block = {positive ? method::to_positive : method::to_negative, velocity_of(profile.velocity_rpm)},
      .command = command::home};
  co_return co_await start(std::move(one), std::move(guard));
}

Task<Result<void>> ServoDrive::start(Start start, MotionGuard guard) {
  Result<void> result;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    result = co_await start_once(start, guard);
    if (result) break;
    const auto& error = result.error();
    const bool trigger_sent = error.where.object == reg::command && error.outcome == Outcome::unknown;
    const bool grown_old = error.reason == Reason::expired && clock_->now() < guard.not_after;
    if (!grown_old && (trigger_sent || error.reason != Reason::no_reply)) break;
  }
  if (!result && result.error().where.object != reg::command && result.error().outcome == Outcome::unknown)
    result.error().outcome = Outcome::not_executed;  // only parameters were written
  co_return result;
}

/// A drive that restarts after its tag was asked for is silent for longer than reboot_guard: a command bound
/// within that never meets default parameters.
Task<Result<void>> ServoDrive::start_once(Start start, MotionGuard guard) {
  TransactionOptions motion{.transaction_class = TransactionClass::motion, .guard = std::move(guard)};
  const auto proven = co_await read_tag(motion);
  if (!proven) co_return fail(proven.error());
  motion.guard.not_after = std::min(motion.guard.not_after, *proven + setup_.reboot_guard);
  const auto block = co_await node_.write_block(start.first, start.block, motion);
  if (!block) co_return failed(block.error());
  const auto triggered = co_await node_.write(reg::command, start.command, motion);
  if (!triggered) co_return failed(triggered.error());
  co_return Result<void>{};
}

Task<Result<void>> ServoDrive::stop(StopKind kind) {
  const auto code = kind == StopKind::quick_stop ? stop::quick : stop::ramp;
  for (int attempt = 1;; ++attempt) {
    const auto written = co_await node_.write(reg::stop, code, in(TransactionClass::stop));
    if (written && written->certain) co_return Result<void>{};
    if (!written && (written.error().reason != Reason::refused || attempt == attempts))
      co_return failed(written.error());
    if (!written) continue;
    // After the reply to a read no older one can follow: the next echo is its own.
    const auto read = co_await node_.read(reg::fault, 1, in(TransactionClass::motion));
    if (read) continue;
    auto unheard = read.error();
    unheard.reason = Reason::no_reply;
    unheard.outcome = Outcome::unknown;
    co_return failed(std::move(unheard));
  }
}

Task<Result<void>> ServoDrive::clear_alarm(MotionGuard guard) {
  const auto written = co_await node_.write_patiently(
      reg::fault_reset, 1, {.transaction_class = TransactionClass::parameters, .guard = std::move(guard)});
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

Task<Result<void>> ServoDrive::clear_position(MotionGuard guard) {
  const auto written = co_await node_.write(
      reg::declare_zero, 1, {.transaction_class = TransactionClass::motion, .guard = std::move(guard)});
  if (!written) co_return failed(written.error());
  co_return Result<void>{};
}

}  // namespace axisd::acme_s1
