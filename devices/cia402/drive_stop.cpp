// The control word as it is known to stand in the drive, and stops, which are made of it.
#include <fmt/format.h>

#include <cstdlib>
#include <utility>

#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

using std::chrono::milliseconds;

/// Under a stop nobody waits longer for a mode.
constexpr auto urgent_mode_limit = milliseconds(20);
/// Nor for the reply to what goes before the halt: with the reply lost it is there all the same.
constexpr auto urgent_reply_limit = milliseconds(20);
constexpr std::size_t word_bytes = 2;

/// Of a write that could not be proven. Whatever is wrong with the reading that should prove it: it is no
/// refusal of the write, which may never have reached the drive.
Error unproven(Error reading) {
  reading.reason = Reason::no_reply;
  reading.outcome = Outcome::unknown;
  return reading;
}

}  // namespace

KnownWords::Moment Cia402Drive::moment(TimePoint at) const { return {.at = at, .losses = bus_->losses()}; }

/// What the drive is known to hold is no longer known where the drive shows something else.
void Cia402Drive::note_knowledge(const Reading& reading) {
  const auto mode = reading.values.find(object::mode_display.key());
  const bool told = mode != reading.values.end();
  words_.see_mode(told ? std::optional(static_cast<OperationMode>(mode->second)) : std::nullopt,
                  reading.asked_at);
  const auto status = reading.values.find(object::status_word.key());
  if (status == reading.values.end()) return;
  words_.see_state(state_of(static_cast<std::uint16_t>(status->second)), moment(reading.asked_at));
}

Task<Result<std::uint16_t>> Cia402Drive::held_control(SdoOptions options) {
  words_.forget_stale(moment(clock_->now()));
  if (words_.control()) co_return *words_.control();
  const auto newest = words_.newest();
  const auto asked = clock_->now();
  const auto word = co_await read_object(object::control_word, std::move(options));
  if (!word) co_return fail(word.error());
  const auto held = static_cast<std::uint16_t>(*word);
  words_.take_read(held, newest, moment(asked));
  co_return held;
}

Task<Result<void>> Cia402Drive::write_control(std::uint16_t word, SdoOptions options) {
  co_await follow_waiting(word);
  const auto write = words_.begin_write(word);
  const auto answer = co_await node_.sdo().download(node_.id(), object::control_word,
                                                    canopen::number_bytes(word, word_bytes), options);
  const auto ended = clock_->now();
  words_.end_write(ended);
  if (answer || answer.error().outcome == Outcome::unknown) words_.executed(word);
  if (!answer) co_return failed(answer.error());
  if ((word & control::halt) != 0 && !command_pdo_) stops_.note_frame(answer->sent_at);
  if (!words_.is_newest(write)) co_return Result<void>{};  // overtaken by a later one
  if (answer->ambiguous) {
    const auto held = co_await held_control(std::move(options));
    if (!held) co_return fail(unproven(held.error()));
    if (*held != word)
      co_return fail(
          error_at(Reason::no_reply, object::control_word,
                   fmt::format("the control word reads {:04X}h after {:04X}h was written", *held, word),
                   "check whether another master writes to this drive"));
    co_return Result<void>{};
  }
  words_.confirm(word, moment(ended));
  co_return Result<void>{};
}

/// A stopped node takes neither SDO nor PDO (CiA 301 table 38); operational alone moves nothing.
Task<> Cia402Drive::wake_if_stopped() {
  if (bus_->master().nmt().status(node_.id()).state == canopen::NmtState::stopped)
    (void)co_await bus_->master().command(node_.id(), canopen::NmtCommand::start, TransactionClass::stop);
}

/// At once, where there is an RPDO for it. Nobody confirms it: the same follows by SDO.
Task<> Cia402Drive::send_control_pdo(std::uint16_t word) {
  if (!command_pdo_) co_return;
  const auto sent = co_await bus_->master().send_pdo(*command_pdo_, canopen::number_bytes(word, word_bytes),
                                                     {.transaction_class = TransactionClass::stop});
  if (sent && (word & control::halt) != 0) stops_.note_frame(sent->sent_at);
}

/// M12. In a mode that nobody knows it does no harm, and it asks for no knowledge of the control word.
Task<> Cia402Drive::zero_velocity(SdoOptions options) {
  if (!has_velocity_mode() || (words_.mode() && words_.mode() != OperationMode::profile_velocity)) co_return;
  (void)co_await write_object(object::target_velocity, 0, 0, std::move(options));
}

/// 605Dh. Nothing is written to a drive that halts in one way: it would refuse that, and the halt would go
/// out later.
Task<> Cia402Drive::choose_halt(bool quick, SdoOptions options) {
  if (model_->halts_in_one_way) co_return;
  const bool at_once = quick && !brakes_softer_in_quick_stop();
  const auto option = at_once ? model_->meaning.halt_at_once : model_->meaning.halt_on_ramp;
  if (words_.halt_option() == option) co_return;
  words_.set_halt_option(std::nullopt);
  const auto written = co_await write_object(object::halt_option, option, 0, std::move(options));
  if (written) words_.set_halt_option(option);
  const bool refused = !written && written.error().outcome == Outcome::refused;
  if (at_once && refused) seen_.halts_on_ramp_alone = true;
}

Task<Result<void>> Cia402Drive::read_quick_stop_ramp(SdoOptions options) {
  if (model_->descriptor->capabilities.quick_stop_ramp != QuickStopRamp::own) co_return Result<void>{};
  const auto held = co_await read_object(object::quick_stop_deceleration, std::move(options));
  if (held) co_return Result<void>{};
  if (held.error().outcome != Outcome::refused) co_return fail(held.error());
  seen_.quick_stop_ramp.reset();
  co_return Result<void>{};
}

bool Cia402Drive::brakes_softer_in_quick_stop() const {
  const auto& capabilities = model_->descriptor->capabilities;
  const auto own = seen_.quick_stop_ramp.value_or(0);
  if (capabilities.quick_stop_ramp != QuickStopRamp::own || own <= 0) return false;
  auto of_stop = capabilities.fixed_deceleration;
  if (of_stop == 0 && canary_.blocks().empty()) return false;
  if (of_stop == 0)
    of_stop = canary_.blocks().back()[capabilities.own_deceleration ? deceleration : acceleration];
  const bool times = model_->meaning.units.ramps == Ramps::times;
  return times ? own > of_stop : own < of_stop;
}

std::optional<Duration> Cia402Drive::quick_stop_time(int rpm) const {
  constexpr Duration longest = std::chrono::minutes(1);
  const auto kind = model_->descriptor->capabilities.quick_stop_ramp;
  if (kind == QuickStopRamp::none) return Duration{};
  const auto& ramp = seen_.quick_stop_ramp;
  const bool own = kind == QuickStopRamp::own && ramp.value_or(0) > 0 && !seen_.halts_on_ramp_alone;
  if (!own || brakes_softer_in_quick_stop()) return std::nullopt;
  const auto& units = model_->meaning.units;
  const auto time = units.ramps == Ramps::times
                        ? milliseconds(*ramp)
                        : time_of_ramp(units.acceleration, setup_.pulses_per_revolution, rpm, *ramp);
  return std::min<Duration>(time, longest);
}

Task<Result<void>> Cia402Drive::stop(StopKind kind) {
  stops_.begin_stop();
  motion_.stop(stops_.triggers() || homing_.active());
  homing_.stop(words_.homes());
  bus_->purge_superseded(node_.id(), homing_.gate());
  give_up_common_start();
  const auto sent = co_await send_stop(kind == StopKind::quick_stop);
  stops_.end_stop(clock_->now());
  co_return sent;
}

/// Works on a node of which nothing is known, and never changes the power stage: bits 0 to 3 stay as the
/// drive has them. Never bit 2 (M12): without 605Ah and 6085h nobody knows how the drive would stop.
Task<Result<void>> Cia402Drive::send_stop(bool quick) {
  const SdoOptions urgent{.transaction_class = TransactionClass::stop};
  const SdoOptions first{.transaction_class = TransactionClass::stop, .timeout = urgent_reply_limit};
  co_await wake_if_stopped();
  words_.forget_stale(moment(clock_->now()));
  const auto with_halt = [](std::uint16_t bits) { return static_cast<std::uint16_t>(bits | control::halt); };
  // A quick stop first has to say how: 605Dh may be read when bit 8 rises, and a ramp that 60FFh = 0 began
  // may be all that the drive then does.
  // But what waits for a SYNC goes first: it would undo the halt. It was armed in Operation Enabled; or it is
  // shown by a released drive, which its bits alone leave so.
  const bool shown = start_pdo_.work() == StartPdo::Work::proving;
  if (words_.state_bits() || !shown)
    co_await follow_waiting(
        with_halt(words_.state_bits().value_or(control_word(ControlCommand::enable_operation))));
  const bool known = words_.state_bits().has_value();
  if (known && !quick) co_await send_control_pdo(with_halt(*words_.state_bits()));
  if (!known || !quick) co_await zero_velocity(first);
  co_await choose_halt(quick, first);
  if (quick && words_.state_bits()) co_await send_control_pdo(with_halt(*words_.state_bits()));
  const auto& word = words_.control();
  bool was_halted = word ? (*word & control::halt) != 0 : words_.halt() != KnownWords::Halt::none;
  if (!words_.state_bits()) {
    const auto held = co_await held_control(urgent);
    if (!held) {
      co_await wake_unheard();
      // Whatever is wrong with the reading: it is no refusal of the stop, which was not sent yet.
      auto unheard = held.error();
      unheard.reason = Reason::no_reply;
      co_return fail(std::move(unheard));
    }
    was_halted = (*held & control::halt) != 0;
    words_.take_bits(static_cast<std::uint16_t>(*held & control::state_bits));
  }
  const auto bits = *words_.state_bits();
  auto sent = co_await write_control(with_halt(bits), urgent);
  if (known && quick) co_await zero_velocity(urgent);
  // Under a halt that stands already bit 8 has no edge: what a terminal has started since goes on, and so
  // does the ramp under a quick stop.
  const bool stronger = quick && !words_.halt_is_quick();
  const bool unseen = words_.halt() != KnownWords::Halt::braking;
  const bool operates = bits == control_word(ControlCommand::enable_operation);
  const bool under_halt = operates && was_halted && (stronger || unseen);
  // 6.2.2: the motor is energised there, too, and a terminal may have started it. Bit 8 means nothing there.
  const bool switched_on = bits == control_word(ControlCommand::switch_on);
  if ((under_halt || switched_on) && co_await turns(urgent)) {
    sent = co_await halt_again(bits, urgent);
    if (sent) was_halted = false;
  }
  if (!was_halted) words_.halted(clock_->now(), quick);
  co_return sent;
}

/// A node without heartbeat does not say that it was stopped by NMT.
Task<> Cia402Drive::wake_unheard() {
  if (bus_->master().nmt().status(node_.id()).state == canopen::NmtState::unknown)
    (void)co_await bus_->master().command(node_.id(), canopen::NmtCommand::start, TransactionClass::stop);
}

/// As the drive says now; where it does not, as it said last.
Task<bool> Cia402Drive::turns(SdoOptions options) {
  const auto& objects = model_->objects;
  const auto bit = model_->status.moving;
  const auto source =
      bit != 0 ? std::optional(object::status_word) : (objects.moving ? objects.moving : objects.velocity);
  if (!source) co_return motion_.moves();
  const auto shown = co_await read_object(*source, std::move(options));
  if (!shown) co_return motion_.moves();
  if (bit != 0) co_return (*shown & bit) != 0;
  if (objects.moving || !known_by_way()) co_return *shown != 0;
  const auto rpm = decode_velocity(*model_, setup_.pulses_per_revolution, *shown);
  co_return motion_.moves() || std::abs(rpm) > velocity_noise();
}

/// Under a stop: soon, or not at all. Errors: of change_mode().
Task<Result<void>> Cia402Drive::choose_mode_soon(OperationMode mode, SdoOptions options) {
  constexpr int attempts = 3;
  Result<void> changed;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    changed = co_await change_mode(mode, options, urgent_mode_limit);
    if (changed || changed.error().reason == Reason::no_reply) break;
  }
  co_return changed;
}

/// An edge of bit 8 on a motor that turns under halt. Between its two words nothing can be behind it:
/// the neutral mode, with 60FFh = 0, as in make_ready(). By RPDO at once, and by SDO, where the drive answers
/// each: one that looks at the word once per cycle sees no edge in the first pair. Nothing where that is not
/// ready: in another mode a move that the halt suspended goes on, and a drive that falls silent may hear the
/// first word of a pair alone. Errors: the drive does not answer, refuses, or stays in another mode.
Task<Result<void>> Cia402Drive::halt_again(std::uint16_t bits, SdoOptions options) {
  const auto word = static_cast<std::uint16_t>(bits | control::halt);
  const auto neutral = model_->neutral_mode;
  if (has_velocity_mode())
    if (auto zeroed = co_await write_object(object::target_velocity, 0, 0, options); !zeroed)
      co_return zeroed;
  // In Switched On it is the change of the mode that ends a motion; and what is under way may be a homing.
  const bool of_neutral = neutral == OperationMode::homing
                              ? words_.mode().value_or(neutral) == neutral
                              : bits == control_word(ControlCommand::switch_on) && words_.mode() == neutral;
  if (of_neutral)
    if (auto left = co_await choose_mode_soon(OperationMode::profile_position, options); !left)
      co_return left;
  words_.use_mode(KnownWords::ModeUse::neutral);
  if (words_.mode() != neutral)
    if (auto chosen = co_await choose_mode_soon(neutral, options); !chosen) co_return chosen;
  // Somebody has led the drive elsewhere meanwhile: these bits would lead it back.
  if (words_.state_bits().value_or(bits) != bits) co_return Result<void>{};
  co_await send_control_pdo(bits);
  co_await send_control_pdo(word);
  (void)co_await write_control(bits, options);
  co_await send_control_pdo(word);
  co_return co_await write_control(word, std::move(options));
}

}  // namespace axisd::cia402
