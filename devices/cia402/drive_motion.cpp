// Starts: the canary, the block, the trigger (M6 to M8), and what each mode of operation needs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "buses/canopen/sdo_abort.hpp"
#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

using std::chrono::milliseconds;

constexpr int chain_attempts = 3;
constexpr auto acknowledge_limit = milliseconds(100);
constexpr auto begin_limit = milliseconds(50);

/// From the slow speed of the last approach, on the ramp of the homing.
std::int32_t braking_pulses(const HomingProfile& profile, std::int64_t pulses_per_revolution) {
  const double seconds = std::chrono::duration<double>(profile.acceleration_time).count();
  const double per_second =
      std::abs(profile.search_velocity_rpm) / 60.0 * static_cast<double>(pulses_per_revolution);
  return static_cast<std::int32_t>(std::lround(per_second * seconds / 2));
}

/// CiA 402: 37, and 35 as it was called before, take the present position for home.
bool is_in_place(const HomingProfile& profile) {
  constexpr int present_position = 37, present_position_too = 35;
  return profile.number == present_position || profile.number == present_position_too;
}

}  // namespace

Task<Result<void>> Cia402Drive::start_move(MoveProfile profile, MotionGuard guard) {
  const auto block = encode(*model_, setup_.pulses_per_revolution, profile);
  co_return co_await start(block, OperationMode::profile_position, std::nullopt,
                           {object::control_word, control::start_word}, std::move(guard));
}

Task<Result<void>> Cia402Drive::start_velocity(VelocityProfile profile, MotionGuard guard) {
  if (!has_velocity_mode())
    co_return fail(error_at(Reason::not_supported, object::target_velocity,
                            "the drive has no profile velocity mode", "move to positions"));
  if (canary_.blocks().empty())
    co_return fail(
        error_at(Reason::configuring, object::target_position, "the drive is not configured yet", "wait"));
  const auto block = encode(*model_, setup_.pulses_per_revolution, profile, canary_.blocks().back());
  const auto velocity = encode_velocity(*model_, setup_.pulses_per_revolution, profile.velocity_rpm);
  if (velocity == 0) co_return fail(too_slow(object::target_velocity));
  co_return co_await start(block, OperationMode::profile_velocity, std::nullopt,
                           {object::target_velocity, velocity}, std::move(guard));
}

std::vector<ContinuityMark> Cia402Drive::marks_until(const MoveProfile& start) const {
  return canary_.marks_until(canary_.distinct(encode(*model_, setup_.pulses_per_revolution, start)));
}

std::vector<ContinuityMark> Cia402Drive::marks_until(const VelocityProfile& start) const {
  if (canary_.blocks().empty()) return {};
  return canary_.marks_until(
      canary_.distinct(encode(*model_, setup_.pulses_per_revolution, start, canary_.blocks().back())));
}

Task<Result<void>> Cia402Drive::start_homing(HomingProfile profile, MotionGuard guard) {
  // Homing uses objects of its own; the motion block is only the canary, and keeps what it holds.
  if (canary_.blocks().empty())
    co_return fail(
        error_at(Reason::configuring, object::target_position, "the drive is not configured yet", "wait"));
  co_return co_await start(canary_.blocks().back(), OperationMode::homing, profile,
                           {object::control_word, control::start_word}, std::move(guard));
}

Task<Result<void>> Cia402Drive::start(MotionBlock block, OperationMode mode,
                                      std::optional<HomingProfile> homing, Trigger trigger,
                                      MotionGuard guard) {
  Result<void> result;
  bool triggered = false;
  for (int attempt = 0; attempt < chain_attempts; ++attempt) {
    result = co_await start_once(block, mode, homing, trigger, guard, triggered);
    if (result || triggered) break;
    const auto& error = result.error();
    // The canary had grown too old for the trigger, or a reply was lost before it: the chain begins anew.
    const bool canary_expired = error.reason == Reason::expired && clock_->now() < guard.not_after;
    if (!canary_expired && error.reason != Reason::no_reply) break;
  }
  if (!result && !triggered && result.error().reason == Reason::expired && clock_->now() < guard.not_after)
    result = fail(answers_too_late());
  if (!result && !triggered && result.error().outcome == Outcome::unknown)
    result.error().outcome = Outcome::not_executed;  // only parameters were written
  co_return result;
}

Error Cia402Drive::answers_too_late() const {
  const auto in_ms = [](Duration time) { return std::chrono::duration<double, std::milli>(time).count(); };
  return error_at(
      Reason::expired, object::control_word,
      fmt::format("nothing was started: the drive takes {:.0f} ms to answer, and the proof that it "
                  "did not restart may be {:.0f} ms old (reboot_guard)",
                  in_ms(seen_.answer_time), in_ms(setup_.reboot_guard)),
      "look at the load of the network; raise reboot_guard up to what the drive needs to boot");
}

Error Cia402Drive::too_slow(Object object) const {
  return error_at(Reason::out_of_range, object, "the velocity is less than one of the drive's counts",
                  "ask for a higher one, or let the drive count in a finer unit");
}

Task<Result<void>> Cia402Drive::start_once(MotionBlock block, OperationMode mode,
                                           std::optional<HomingProfile> homing, Trigger trigger,
                                           MotionGuard guard, bool& triggered) {
  const SdoOptions motion{.transaction_class = TransactionClass::motion, .guard = guard};
  give_up_leaving();
  const auto canary = co_await prepare_start(block, mode, homing, motion);
  if (!canary) co_return fail(canary.error());
  // A drive that restarts after the canary was read is silent for longer than reboot_guard: a trigger bound
  // within it never meets default parameters.
  auto fresh = motion;
  fresh.guard.not_after = std::min(guard.not_after, *canary + setup_.reboot_guard);
  if (const auto pulled = co_await pull_trigger(mode, trigger, fresh, triggered); !pulled) co_return pulled;
  if (mode == OperationMode::profile_position) co_await acknowledge_set_point(motion);
  if (mode == OperationMode::homing) co_await see_homing_begin(motion);
  co_return Result<void>{};
}

/// It may be over before the state is read again, and leave nothing that was not there before: the bit of the
/// last homing, and the counter at 0.
Task<> Cia402Drive::see_homing_begin(SdoOptions options) {
  if (!homing_.active() || homing_.prepared().was_low) co_return;
  const auto begun = [this](std::int64_t shown) {
    const Values values{{object::status_word.key(), shown},
                        {object::mode_display.key(), std::to_underlying(OperationMode::homing)}};
    const auto word = static_cast<std::uint16_t>(shown);
    return (word & model_->status.moving) != 0 || !home_bit(*model_, values).value_or(false);
  };
  const auto word = co_await read_until(object::status_word, begun, begin_limit, std::move(options));
  if (word && begun(*word)) homing_.note_begun();
}

Error Cia402Drive::not_enabled(State state) const {
  return error_at(Reason::disabled, object::status_word, fmt::format("the drive is in {}", to_string(state)),
                  "enable the axis first");
}

Task<Result<TimePoint>> Cia402Drive::prepare_start(MotionBlock block, OperationMode mode,
                                                   std::optional<HomingProfile> homing, SdoOptions motion) {
  if (contact_.rebooted()) co_return fail(lost_memory());
  if (mode == OperationMode::profile_position && block[speed] <= 0)
    co_return fail(too_slow(object::profile_velocity));
  if (const auto settled = co_await settle_armed(motion); !settled) co_return fail(settled.error());
  const auto state = co_await read_status(motion);
  if (!state) co_return fail(state.error());
  if (*state != State::operation_enabled) co_return fail(not_enabled(*state));
  if (const auto ready = co_await make_ready(*state, mode, motion); !ready) co_return fail(ready.error());
  if (homing)
    if (const auto prepared = co_await prepare_homing(*homing, motion); !prepared)
      co_return fail(prepared.error());

  if (const auto canary = co_await read_canary(motion); !canary) co_return canary;
  if (!homing)
    if (const auto written = co_await write_canary(canary_.distinct(block), motion); !written)
      co_return fail(written.error());
  co_return co_await prove_block(motion);
}

Task<Result<void>> Cia402Drive::pull_trigger(OperationMode mode, Trigger trigger, SdoOptions options,
                                             bool& triggered) {
  if (contact_.rebooted()) co_return fail(lost_memory());
  const auto began = clock_->now();
  const auto stops = stops_.count();
  const bool by_control = trigger.object == object::control_word;
  if (mode == OperationMode::homing) words_.use_mode(KnownWords::ModeUse::motion);
  stops_.begin_trigger();
  auto pulled = by_control ? co_await write_control(static_cast<std::uint16_t>(trigger.value), options)
                           : co_await write_object(trigger.object, trigger.value, 0, options);
  stops_.end_trigger();
  triggered = pulled || pulled.error().outcome == Outcome::unknown;
  if (!triggered || stops != stops_.count()) co_return pulled;
  motion_.begin(began);
  if (mode == OperationMode::profile_velocity) motion_.turns(trigger.value < 0);
  if (mode == OperationMode::profile_position) note_move_began(began);
  if (mode == OperationMode::homing) homing_.begin(began, motion_.position());
  co_return pulled;
}

void Cia402Drive::note_move_began(TimePoint at) {
  motion_.begin(at);
  if (motion_.position() && !canary_.blocks().empty())
    motion_.turns(canary_.blocks().front()[target] < *motion_.position());
}

/// The drive has taken the set-point: bit 4 goes back, so that nothing is left to take. What fails here does
/// not matter to the motion, which has begun; the next start finds bit 4 as it is. The guard keeps all of it
/// behind a stop, which it would undo.
Task<> Cia402Drive::acknowledge_set_point(SdoOptions options) {
  const auto taken = [](std::int64_t word) { return (word & status::mode_specific) != 0; };
  (void)co_await read_until(object::status_word, taken, acknowledge_limit, options);
  (void)co_await write_control(control_word(ControlCommand::enable_operation), std::move(options));
}

/// In homing mode already, at rest. Compared and not just written: some drives save these.
Task<Result<void>> Cia402Drive::prepare_homing(HomingProfile profile, SdoOptions options) {
  HomingWatch::Start start{.offset = profile.offset_pulses,
                           .braking = braking_pulses(profile, setup_.pulses_per_revolution),
                           .window = position_window(),
                           .in_place = is_in_place(profile)};
  const auto word = co_await read_object(object::status_word, options);
  if (!word) co_return fail(word.error());
  const auto bits = static_cast<std::uint16_t>(*word);
  start.tied_to_rest = (bits & status::mode_specific) != 0 && (bits & model_->status.homed) == 0;
  const auto both = static_cast<std::uint16_t>(status::mode_specific | model_->status.homed);
  for (const auto& [object, value] : encode(*model_, setup_.pulses_per_revolution, profile)) {
    const bool is_speed = object == object::homing_speed || object == object::homing_search_speed;
    if (is_speed && value == 0) co_return fail(too_slow(object));
    const auto present = co_await read_object(object, options);
    if (!present) co_return fail(present.error());
    if (*present == value) continue;
    if (const auto written = co_await write_verified(object, value, options); !written) co_return written;
  }
  if (const auto chosen = co_await write_homing_method(profile, options); !chosen) co_return chosen;
  homing_.prepare(start);
  if ((bits & both) != 0) co_return Result<void>{};
  // Twice: the bits may follow the mode a cycle late.
  const auto again = co_await read_object(object::status_word, std::move(options));
  if (!again) co_return fail(again.error());
  start.was_low = (*again & both) == 0;
  homing_.prepare(start);
  co_return Result<void>{};
}

/// The manual has two lists of codes (6.2.6: 17 ... 29, chapter 7: 0 ... 3): the drive says which it knows.
Task<Result<void>> Cia402Drive::write_homing_method(HomingProfile profile, SdoOptions options) {
  if (profile.number) {
    const auto present = co_await read_object(object::homing_method, options);
    if (present && *present == *profile.number) co_return Result<void>{};
    co_return co_await write_verified(object::homing_method, *profile.number, std::move(options));
  }
  const auto code = std::ranges::find(model_->homing_codes, profile.method, &HomingCode::method);
  if (code == model_->homing_codes.end())
    co_return fail(error_at(Reason::not_supported, object::homing_method,
                            "the drive has no such homing method", "choose another homing: { method: }"));
  const auto take = [](Cia402Drive& drive, std::int64_t value, SdoOptions how) -> Task<Result<void>> {
    const auto present = co_await drive.read_object(object::homing_method, how);
    if (present && *present == value) co_return Result<void>{};
    co_return co_await drive.write_verified(object::homing_method, value, std::move(how));
  };
  if (!seen_.other_homing_codes) {
    auto taken = co_await take(*this, code->code, options);
    const bool unknown = !taken && taken.error().reason == Reason::out_of_range;
    if (!unknown || !code->alternative) co_return taken;
  }
  auto taken = co_await take(*this, code->alternative.value_or(code->code), std::move(options));
  if (taken) seen_.other_homing_codes = true;
  co_return taken;
}

Task<Result<void>> Cia402Drive::clear_position(MotionGuard guard) {
  const SdoOptions options{.transaction_class = TransactionClass::motion, .guard = std::move(guard)};
  const bool by_homing = !model_->objects.position_clear && !model_->homing_codes.empty();
  if (model_->objects.position_clear || by_homing) {
    const auto cleared = by_homing ? co_await home_here(options)
                                   : co_await write_object(*model_->objects.position_clear, 1, 0, options);
    motion_.counter_jumped();
    co_return cleared;
  }
  co_return fail(error_at(Reason::not_supported, object::position,
                          "the drive cannot zero its position counter", "home the axis"));
}

/// Homing method 35 (CiA 402): the present position is home, without a motion.
Task<Result<void>> Cia402Drive::home_here(SdoOptions options) {
  constexpr std::int64_t present_position = 35;
  give_up_leaving();
  if (const auto settled = co_await settle_armed(options); !settled) co_return settled;
  const auto state = co_await read_status(options);
  if (!state) co_return fail(state.error());
  if (*state != State::operation_enabled) co_return fail(not_enabled(*state));
  if (const auto ready = co_await make_ready(*state, OperationMode::homing, options); !ready) co_return ready;
  if (has(*model_, object::home_offset))
    if (const auto zero = co_await write_verified(object::home_offset, 0, options); !zero) co_return zero;
  const auto chosen = co_await write_verified(object::homing_method, present_position, options);
  if (!chosen) co_return chosen;
  if (const auto told = co_await write_control(control::start_word, options); !told) co_return told;
  const auto attained = [](std::int64_t word) {
    return (word & status::mode_specific) != 0 && (word & status::target_reached) != 0;
  };
  const auto word = co_await read_until(object::status_word, attained, acknowledge_limit, options);
  const auto ended =
      co_await write_control(control_word(ControlCommand::enable_operation), std::move(options));
  if (!word) co_return fail(word.error());
  if (!attained(*word))
    co_return fail(error_at(Reason::not_confirmed, object::status_word,
                            "the drive does not report the present position as home", "home the axis"));
  co_return ended;
}

}  // namespace axisd::cia402
