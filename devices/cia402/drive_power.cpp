// The power stage. Power never moves (M23).
//
// What could turn the shaft when 0Fh is sent or halt is released: 60FFh in velocity mode (there 0Fh is the
// start command, 6.2.2), bit 4, and a set-point that a halt suspended. What releasing halt does with the last
// is not said (6.2.4 "ends the present position", CiA 402 goes on with it), so it is released in velocity
// mode with 60FFh = 0, where a set-point means nothing, and position mode is chosen after that. A drive
// without velocity mode has another one for that: Model::neutral_mode.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

using std::chrono::milliseconds;

constexpr auto transition_limit = milliseconds(1000);
/// After a word whose reply was lost, before it is sent again.
constexpr auto lost_transition_limit = milliseconds(100);
constexpr auto watch_time = milliseconds(30), watch_pause = milliseconds(5);
/// Beyond the time to watch: a shaft whose velocity has not fallen back to noise by then does not rest.
constexpr auto longest_unrest = milliseconds(100);
/// Readings in a row of a velocity beyond its noise, in one direction: a motion, however slow. Fewer are the
/// controller taking hold of the shaft.
constexpr int turning_readings = 3;

/// The control word that keeps a state and asks for nothing.
std::uint16_t quiet_word(State state) {
  if (state == State::operation_enabled) return control_word(ControlCommand::enable_operation);
  return state == State::switched_on ? control_word(ControlCommand::switch_on)
                                     : control_word(ControlCommand::disable_voltage);
}

constexpr std::int64_t number_of(OperationMode mode) { return std::to_underlying(mode); }

}  // namespace

Task<Result<State>> Cia402Drive::read_status(SdoOptions options) {
  const auto word = co_await read_object(object::status_word, std::move(options));
  if (!word) co_return fail(word.error());
  co_return state_of(static_cast<std::uint16_t>(*word));
}

Task<Result<void>> Cia402Drive::change_mode(OperationMode mode, SdoOptions options, Duration limit) {
  const auto present = co_await read_object(object::mode_display, options);
  if (!present) co_return fail(present.error());
  if (*present != number_of(mode)) {
    words_.leave_mode();
    const auto written = co_await write_object(object::mode, number_of(mode), 1, options);
    words_.mode_written(clock_->now());
    if (!written) co_return written;
  }
  const auto fits = [wanted = number_of(mode)](std::int64_t shown) { return shown == wanted; };
  const auto shown = co_await read_until(object::mode_display, fits, limit, std::move(options));
  if (!shown) co_return fail(shown.error());
  if (!fits(*shown))
    co_return fail(error_at(Reason::refused, object::mode_display,
                            fmt::format("the drive stays in mode {} instead of {}", *shown, number_of(mode)),
                            "check whether another master writes to this drive, and its alarm"));
  words_.mode_reached(mode, clock_->now());
  if (mode != OperationMode::homing) homing_.left();
  co_return Result<void>{};
}

Task<Result<std::int64_t>> Cia402Drive::read_target_velocity(SdoOptions options) {
  if (!has_velocity_mode()) co_return std::int64_t{0};
  co_return co_await read_object(object::target_velocity, std::move(options));
}

Task<Result<void>> Cia402Drive::clear_target_velocity(SdoOptions options) {
  if (!has_velocity_mode()) co_return Result<void>{};
  co_return co_await write_verified(object::target_velocity, 0, std::move(options));
}

/// Where that is homing mode it is entered anew, so that no homing that a halt interrupted goes on, either.
Task<Result<void>> Cia402Drive::enter_neutral_mode(SdoOptions options) {
  if (model_->neutral_mode == OperationMode::homing)
    if (auto left = co_await change_mode(OperationMode::profile_position, options); !left) co_return left;
  words_.use_mode(KnownWords::ModeUse::neutral);
  auto entered = co_await change_mode(model_->neutral_mode, std::move(options));
  const bool refused =
      !entered && (entered.error().reason == Reason::refused || entered.error().outcome == Outcome::refused);
  if (refused && model_->neutral_mode == OperationMode::none) {
    entered.error().message += ": it cannot rest in no mode, and has neither velocity nor homing mode";
    entered.error().remedy = "where it has one of them, say so: drive: { objects: ... }";
  }
  co_return entered;
}

/// Leaves nothing that the end of a halt, or 0Fh, could start; in Operation Enabled halted. Everything is
/// read back.
Task<Result<void>> Cia402Drive::neutralise(State state, SdoOptions options) {
  const auto held = co_await held_control(options);
  if (!held) co_return fail(held.error());
  const bool halted = state == State::operation_enabled || (*held & control::halt) != 0;
  const auto word = static_cast<std::uint16_t>(quiet_word(state) | (halted ? control::halt : 0U));
  if (*held != word)
    if (const auto written = co_await write_control(word, options); !written) co_return written;
  if (const auto zero = co_await clear_target_velocity(options); !zero) co_return zero;
  if (words_.halt_option() != model_->meaning.halt_on_ramp) {
    // After a quick stop; drives without the object have one way to halt.
    words_.set_halt_option(std::nullopt);
    const auto ramp = co_await write_object(object::halt_option, model_->meaning.halt_on_ramp, 0, options);
    if (!ramp && ramp.error().outcome != Outcome::refused) co_return ramp;
    words_.set_halt_option(model_->meaning.halt_on_ramp);
  }
  if (const auto mode = co_await enter_neutral_mode(options); !mode) co_return mode;
  words_.doubt_control();
  const auto now = co_await held_control(options);
  if (!now) co_return fail(now.error());
  const auto speed = co_await read_target_velocity(std::move(options));
  if (!speed) co_return fail(speed.error());
  if (*now == word && *speed == 0) co_return Result<void>{};
  co_return fail(
      error_at(Reason::misconfigured, object::control_word,
               fmt::format("control word {:04X}h instead of {:04X}h, target velocity {} instead of 0", *now,
                           word, *speed),
               "check whether another master writes to this drive"));
}

/// Makes the drive wait in `mode` with nothing under way. In Operation Enabled it is ready for a start then.
Task<Result<void>> Cia402Drive::make_ready(State state, OperationMode mode, SdoOptions options) {
  const auto held = co_await held_control(options);
  if (!held) co_return fail(held.error());
  const bool enabled = state == State::operation_enabled;
  const bool halted = (*held & control::halt) != 0;
  if (enabled && !halted) co_return co_await leave_halt(state, mode, std::nullopt, std::move(options));
  if (const auto neutral = co_await neutralise(state, options); !neutral) co_return neutral;
  const auto base = co_await read_object(object::position, options);
  if (!base) co_return fail(base.error());
  if (!enabled) co_return co_await leave_halt(state, mode, std::nullopt, std::move(options));
  co_return co_await stopped_unless(co_await leave_halt(state, mode, *base, std::move(options)));
}

/// Writes the control word without halt, and the mode. From `position` the shaft must not turn meanwhile.
Task<Result<void>> Cia402Drive::leave_halt(State state, OperationMode mode,
                                           std::optional<std::int64_t> position, SdoOptions options) {
  const auto quiet = quiet_word(state);
  if (words_.control() != quiet)
    if (const auto written = co_await write_control(quiet, options); !written) co_return written;
  if (position)
    if (const auto rests = co_await watch_standstill(*position, options); !rests) co_return rests;
  // 0Fh in velocity mode is a start (6.2.2): there is nothing that it could start.
  if (mode == OperationMode::profile_velocity)
    if (const auto zero = co_await write_verified(object::target_velocity, 0, options); !zero) co_return zero;
  if (const auto changed = co_await change_mode(mode, options); !changed) co_return changed;
  if (position) co_return co_await watch_standstill(*position, std::move(options));
  co_return Result<void>{};
}

/// Where power or the end of a halt could not be watched to its end (a reply was lost), the drive is halted
/// again: the next attempt begins from there, and has it watched.
Task<Result<void>> Cia402Drive::stopped_unless(Result<void> watched) {
  if (!watched && watched.error().reason != Reason::terminal) (void)co_await stop(StopKind::stop);
  co_return watched;
}

/// r/min that the shaft turns with beyond noise, signed. Nothing: the drive says that it moves.
Task<Result<std::optional<std::int64_t>>> Cia402Drive::read_turning(SdoOptions options) {
  const auto& objects = model_->objects;
  const auto source = objects.moving ? objects.moving : objects.velocity;
  if (!source) co_return 0;
  const auto shown = co_await read_object(*source, std::move(options));
  if (!shown) co_return fail(shown.error());
  if (objects.moving) co_return *shown == 0 ? std::optional<std::int64_t>(0) : std::nullopt;
  const auto rpm = decode_velocity(*model_, setup_.pulses_per_revolution, *shown);
  co_return std::abs(rpm) > velocity_noise() ? rpm : 0;
}

/// Power is on, or a halt is released, and nothing was started: the shaft stays where it is, or is stopped.
/// Where it is, is what the drive itself takes for in position (M30).
Task<Result<void>> Cia402Drive::watch_standstill(std::int64_t position, SdoOptions options) {
  const auto until = clock_->now() + watch_time;
  // Some drives take a whole revolution for in position.
  const auto window =
      std::min(position_window(), std::max<std::int64_t>(10, setup_.pulses_per_revolution / 100));
  int turning = 0;  // readings in a row, signed as they are
  for (;;) {
    const auto rpm = co_await read_turning(options);
    if (!rpm) co_return fail(rpm.error());
    const int sign = rpm->value_or(0) == 0 ? 0 : (rpm->value_or(0) < 0 ? -1 : 1);
    turning = sign == 0 || turning * sign < 0 ? sign : turning + sign;
    const auto now = co_await read_object(object::position, options);
    if (!now) co_return fail(now.error());
    const auto way = way_between(static_cast<std::int32_t>(position), static_cast<std::int32_t>(*now));
    const bool unrest = clock_->now() >= until + longest_unrest;
    if (!*rpm || std::abs(turning) >= turning_readings || std::abs(way) > window || unrest) {
      (void)co_await stop(StopKind::quick_stop);  // the caller stops it again, and watches it
      co_return fail(error_at(Reason::terminal, object::position,
                              "the shaft turned although nothing was started; stopped",
                              "check terminals that start motion and other masters; then reset the axis"));
    }
    if (clock_->now() >= until && turning == 0) co_return Result<void>{};
    co_await sleep_until(executor_, *clock_, clock_->now() + watch_pause);
  }
}

/// Just before 0Fh: what make_ready() left is what stands there.
Task<Result<void>> Cia402Drive::confirm_nothing_pending(SdoOptions options) {
  const auto word = co_await read_object(object::control_word, options);
  if (!word) co_return fail(word.error());
  const auto speed = co_await read_target_velocity(options);
  if (!speed) co_return fail(speed.error());
  const auto mode = co_await read_object(object::mode_display, std::move(options));
  if (!mode) co_return fail(mode.error());
  const bool asks = (static_cast<std::uint16_t>(*word) & ~control::state_bits) != 0;
  if (!asks && *speed == 0 && *mode == number_of(OperationMode::profile_position)) co_return Result<void>{};
  co_return fail(error_at(
      Reason::misconfigured, object::control_word,
      fmt::format("not enabled: something could start (control word {:04X}h, target velocity {}, mode {})",
                  *word, *speed, *mode),
      "check whether another master writes to this drive"));
}

/// One transition. Its word may be sent twice: it asks for a state, and not for a motion.
Task<Result<State>> Cia402Drive::make_step(Transition step, SdoOptions options) {
  constexpr int attempts = 2;
  const auto arrived = [to = step.to](std::int64_t shown) {
    return state_of(static_cast<std::uint16_t>(shown)) == to;
  };
  for (int attempt = 1;; ++attempt) {
    // Without a reply the state tells whether it was executed.
    const auto written = co_await write_control(control_word(*step.command), options);
    if (!written && written.error().outcome != Outcome::unknown) co_return fail(written.error());
    const auto limit = written ? transition_limit : lost_transition_limit;
    const auto word = co_await read_until(object::status_word, arrived, limit, options);
    if (!word) co_return fail(word.error());
    if (arrived(*word) || written || attempt == attempts)
      co_return state_of(static_cast<std::uint16_t>(*word));
  }
}

/// `operates`: 0Fh may have been sent.
Task<Result<void>> Cia402Drive::step_to_enabled(State state, bool& operates, SdoOptions options) {
  std::optional<std::int64_t> position;
  while (const auto step = next_to_enabled(state)) {
    if (step->to == State::operation_enabled) {
      // 07h has energised the motor already (6.2.2 bit 13): from here on it stands.
      if (const auto clear = co_await confirm_nothing_pending(options); !clear) co_return clear;
      const auto base = co_await read_object(object::position, options);
      if (!base) co_return fail(base.error());
      position = *base;
      operates = true;
    }
    const auto made = co_await make_step(*step, options);
    if (!made && !position) co_return fail(made.error());
    if (!made) co_return co_await stopped_unless(fail(made.error()));
    state = *made;
    if (state != step->to)
      co_return fail(error_at(Reason::not_confirmed, object::status_word,
                              fmt::format("transition {}: the drive is in {} instead of {}", step->number,
                                          to_string(state), to_string(step->to)),
                              "check alarm, supply and terminals that release the motor"));
  }
  if (position) co_return co_await stopped_unless(co_await watch_standstill(*position, std::move(options)));
  co_return fail(error_at(
      Reason::alarm, object::status_word,
      fmt::format("the drive is in {}: it cannot be enabled", to_string(state)),
      state == State::quick_stop_active ? "disable the axis first" : "clear the alarm and reset the axis"));
}

Task<Result<void>> Cia402Drive::enable(MotionGuard guard) {
  const SdoOptions options{.transaction_class = TransactionClass::motion, .guard = std::move(guard)};
  give_up_leaving();
  if (const auto settled = co_await settle_armed(options); !settled) co_return settled;
  if (const auto canary = co_await read_canary(options); !canary) co_return fail(canary.error());
  const auto state = co_await read_status(options);
  if (!state) co_return fail(state.error());
  if (next_to_enabled(*state) || *state == State::operation_enabled) {
    // In position mode, never in velocity mode.
    const auto ready = co_await make_ready(*state, OperationMode::profile_position, options);
    if (!ready || *state == State::operation_enabled) co_return ready;
  }
  // quiet_word() may have led from Ready To Switch On to Switch On Disabled (7).
  const auto word = co_await read_object(object::status_word, options);
  if (!word) co_return fail(word.error());
  const auto now = state_of(static_cast<std::uint16_t>(*word));
  const bool energised = is_energised(now) || (*word & model_->status.enabled) != 0;
  bool operates = false;
  auto enabled = co_await step_to_enabled(now, operates, options);
  if (!enabled && !operates && !energised) co_await release_again(options);
  co_return enabled;
}

/// An enable that failed before 0Fh leaves no motor energised, as 07h does (6.2.2), unless it turns. Not
/// after somebody has asked for something else; a lease and a deadline that are over do not stand in the way.
Task<> Cia402Drive::release_again(SdoOptions options) {
  constexpr int attempts = 4;
  options.guard.not_after = TimePoint::max();
  options.guard.fencing_token = MotionGuard::needs_no_lease;
  const auto shutdown = static_cast<std::uint16_t>(control_word(ControlCommand::shutdown) | control::halt);
  for (int attempt = 0; attempt < attempts; ++attempt) {
    if (co_await turns(options) || may_send(options.guard, clock_->now()) != Verdict::send) co_return;
    const auto written = co_await write_control(shutdown, options);
    if (written || written.error().reason != Reason::no_reply) co_return;
  }
}

Task<bool> Cia402Drive::released(SdoOptions options) {
  const auto enabled_bit = model_->status.enabled;
  const auto is_released = [enabled_bit](std::int64_t shown) {
    const auto word = static_cast<std::uint16_t>(shown);
    return enabled_bit != 0 ? (word & enabled_bit) == 0 : !is_energised(state_of(word));
  };
  const auto word =
      co_await read_until(object::status_word, is_released, transition_limit, std::move(options));
  co_return word&& is_released(*word);
}

Task<Result<void>> Cia402Drive::disable(MotionGuard guard) {
  const SdoOptions options{
      .transaction_class = TransactionClass::stop, .guard = std::move(guard), .attempts = 3};
  co_await wake_if_stopped();
  words_.forget_stale(moment(clock_->now()));
  // 0Fh with a motion under way: that ends first, as far as it can.
  if ((words_.control().value_or(0) & control::halt) == 0) (void)co_await stop(StopKind::stop);
  // The halt stays until the next enable has found that nothing is behind it.
  const auto shutdown = static_cast<std::uint16_t>(control_word(ControlCommand::shutdown) | control::halt);
  if (const auto written = co_await write_control(shutdown, options); !written) co_return written;
  if (!co_await released(options)) {
    const auto off =
        static_cast<std::uint16_t>(control_word(ControlCommand::disable_voltage) | control::halt);
    if (const auto written = co_await write_control(off, options); !written) co_return written;
    if (!co_await released(options))
      co_return fail(error_at(Reason::not_confirmed, object::status_word,
                              "the drive still reports its power stage as on", "try again"));
  }
  co_return Result<void>{};
}

/// In Fault bits 0 to 3 mean nothing, and 15 leads to Switch On Disabled. They stay as they are all the same:
/// a drive that has left Fault by itself meanwhile, with its motor held, is not released by them.
Task<Result<void>> Cia402Drive::reset_fault(SdoOptions options) {
  const auto held = co_await held_control(options);
  if (!held) co_return fail(held.error());
  const auto quiet = static_cast<std::uint16_t>((*held & control::state_bits) | control::halt);
  if (const auto low = co_await write_control(quiet, options); !low) co_return low;
  const auto reset = static_cast<std::uint16_t>(quiet | control::fault_reset);
  if (const auto edge = co_await write_control(reset, options); !edge) co_return edge;
  const auto word = co_await read_until(
      object::status_word,
      [](std::int64_t shown) { return state_of(static_cast<std::uint16_t>(shown)) != State::fault; },
      transition_limit, options);
  if (!word) co_return fail(word.error());
  co_return co_await write_control(quiet, std::move(options));
}

Task<Result<void>> Cia402Drive::clear_alarm(MotionGuard guard) {
  const SdoOptions options{
      .transaction_class = TransactionClass::parameters, .guard = std::move(guard), .attempts = 3};
  const auto state = co_await read_status(options);
  if (!state) co_return fail(state.error());
  if (const auto zero = co_await clear_target_velocity(options); !zero) co_return zero;
  if (*state == State::fault || *state == State::fault_reaction_active) {
    if (const auto reset = co_await reset_fault(options); !reset) co_return reset;
    const auto now = co_await read_status(options);
    if (!now) co_return fail(now.error());
    if (*now != State::fault) {
      contact_.note_fault_left(clock_->now());
      co_return Result<void>{};
    }
  }
  // What is no fault to CiA 402, or was not reset by bit 7.
  if (!model_->objects.alarm_clear) co_return Result<void>{};
  co_return co_await write_object(*model_->objects.alarm_clear, 1, 0, options);
}

}  // namespace axisd::cia402
