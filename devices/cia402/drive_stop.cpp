// The control word as it is known to stand in the drive, and stops, which are made of it.
#include <fmt/format.h>

#include <cstdlib>
#include <utility>

#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

using std::chrono::milliseconds;

/// What another master may have changed unseen is not known any more after this: state bits of before would
/// energise a drive that somebody has released meanwhile (M1).
constexpr auto proof_lasts = milliseconds(1000);
/// Under a stop nobody waits longer for a mode.
constexpr auto urgent_mode_limit = milliseconds(20);
/// A drive that shows another mode for longer is not on its way to one that it was told.
constexpr auto longest_mode_change = milliseconds(500);
/// Nor for the reply to what goes before the halt: with the reply lost it is there all the same.
constexpr auto urgent_reply_limit = milliseconds(20);
constexpr std::size_t word_bytes = 2;

/// The state in which a drive rests that follows this control word.
State state_after(std::uint16_t word) {
  const auto bits = static_cast<std::uint16_t>(word & control::state_bits);
  if (bits == control_word(Command::enable_operation)) return State::operation_enabled;
  if (bits == control_word(Command::switch_on)) return State::switched_on;
  return bits == control_word(Command::shutdown) ? State::ready_to_switch_on : State::switch_on_disabled;
}

}  // namespace

void Cia402Drive::drop_stale_knowledge() {
  const bool proven = clock_->now() - proven_at_ <= proof_lasts && proven_losses_ == bus_->losses();
  if (!proven) forget_words();
}

void Cia402Drive::forget_words() {
  control_.reset();
  state_bits_.reset();
  mode_.reset();
  mode_use_ = ModeUse::motion;
  halt_option_.reset();
}

void Cia402Drive::prove_words(TimePoint at) {
  proven_at_ = std::max(proven_at_, at);
  proven_losses_ = bus_->losses();
}

/// What the drive is known to hold is no longer known where the drive shows something else.
void Cia402Drive::note_knowledge(const Reading& reading) {
  const auto mode = reading.values.find(object::mode_display.key());
  if (mode != reading.values.end() && reading.asked_at > mode_at_)
    mode_ = static_cast<OperationMode>(mode->second);
  if (mode_ && *mode_ != model_->neutral_mode && reading.asked_at > mode_at_ + longest_mode_change)
    mode_use_ = ModeUse::motion;
  const auto status = reading.values.find(object::status_word.key());
  if (status == reading.values.end()) return;
  if (control_writing_ > 0 || reading.asked_at <= control_at_) return;
  const auto state = state_of(static_cast<std::uint16_t>(status->second));
  if (control_ && state_after(*control_) != state) control_.reset();
  // Whatever led there: with these bits it stays there.
  if (state == State::operation_enabled)
    state_bits_ = control_word(Command::enable_operation);
  else if (state == State::switched_on)
    state_bits_ = control_word(Command::switch_on);
  else if (state_bits_ && state_after(*state_bits_) != state)
    state_bits_.reset();
  prove_words(reading.asked_at);
}

Task<Result<std::uint16_t>> Cia402Drive::held_control(SdoOptions options) {
  drop_stale_knowledge();
  if (control_) co_return *control_;
  const auto writes = control_writes_;
  const auto asked = clock_->now();
  const auto word = co_await read_object(object::control_word, std::move(options));
  if (!word) co_return fail(word.error());
  const auto held = static_cast<std::uint16_t>(*word);
  if (writes == control_writes_) {
    control_ = held;
    state_bits_ = static_cast<std::uint16_t>(held & control::state_bits);
    prove_words(asked);
  }
  co_return held;
}

Task<Result<void>> Cia402Drive::write_control(std::uint16_t word, SdoOptions options) {
  co_await follow_waiting(word);
  // Whoever asks meanwhile (a stop) must not go by what stood there before; but bits that are the same before
  // and after stand there whether this is executed or not.
  const auto bits = static_cast<std::uint16_t>(word & control::state_bits);
  control_.reset();
  if (state_bits_ != bits) state_bits_.reset();
  const auto write = ++control_writes_;
  ++control_writing_;
  const auto answer = co_await node_.sdo().download(node_.id(), object::control_word,
                                                    canopen::number_bytes(word, word_bytes), options);
  --control_writing_;
  control_at_ = clock_->now();
  const bool executed = answer || answer.error().outcome == Outcome::unknown;
  if (executed && (word & control::halt) == 0) halt_.reset();
  if (!answer) co_return failed(answer.error());
  if ((word & control::halt) != 0 && !command_pdo_) stop_sent_at_ = answer->sent_at;
  if (write != control_writes_) co_return Result<void>{};  // overtaken by a later one
  if (answer->ambiguous) {
    const auto held = co_await held_control(std::move(options));
    if (!held) co_return fail(held.error());
    if (*held != word)
      co_return fail(
          error_at(Reason::no_reply, object::control_word,
                   fmt::format("the control word reads {:04X}h after {:04X}h was written", *held, word),
                   "check whether another master writes to this drive"));
    co_return Result<void>{};
  }
  control_ = word;
  state_bits_ = bits;
  prove_words(control_at_);
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
  if (sent && (word & control::halt) != 0) stop_sent_at_ = sent->sent_at;
}

/// M12. In a mode that nobody knows it does no harm, and it asks for no knowledge of the control word.
Task<> Cia402Drive::zero_velocity(SdoOptions options) {
  if (!has_velocity_mode() || (mode_ && *mode_ != OperationMode::profile_velocity)) co_return;
  (void)co_await write_object(object::target_velocity, 0, 0, std::move(options));
}

Task<Result<void>> Cia402Drive::stop(StopKind kind) {
  ++stops_;
  leave_gate_->raise();
  bus_->purge_superseded(node_.id(), *leave_gate_);
  give_up_common_start();
  const bool homes = mode_ == OperationMode::homing && mode_use_ != ModeUse::neutral;
  leave_homing_ = leave_homing_ || homing_.active() || homes;
  if (live_ || triggering_ > 0 || homing_.active()) standstill_.doubt();
  homing_.end();
  live_.reset();
  ++stopping_;
  const auto sent = co_await send_stop(kind == StopKind::quick_stop);
  --stopping_;
  stopped_at_ = clock_->now();
  co_return sent;
}

/// Works on a node of which nothing is known, and never changes the power stage: bits 0 to 3 stay as the
/// drive has them. Never bit 2 (M12): without 605Ah and 6085h nobody knows how the drive would stop.
Task<Result<void>> Cia402Drive::send_stop(bool quick) {
  const SdoOptions urgent{.transaction_class = TransactionClass::stop};
  const SdoOptions first{.transaction_class = TransactionClass::stop, .timeout = urgent_reply_limit};
  co_await wake_if_stopped();
  drop_stale_knowledge();
  const auto with_halt = [](std::uint16_t bits) { return static_cast<std::uint16_t>(bits | control::halt); };
  // A quick stop first has to say how: 605Dh may be read when bit 8 rises, and a ramp that 60FFh = 0 began
  // may be all that the drive then does.
  const bool known = state_bits_.has_value();
  // What waits for a SYNC first: it would undo the halt. It was armed in Operation Enabled.
  co_await follow_waiting(with_halt(state_bits_.value_or(control_word(Command::enable_operation))));
  if (known && !quick) co_await send_control_pdo(with_halt(*state_bits_));
  if (!known || !quick) co_await zero_velocity(first);
  const auto option = quick ? model_->meaning.halt_at_once : model_->meaning.halt_on_ramp;
  if (halt_option_ != option) {
    halt_option_.reset();
    if (co_await write_object(object::halt_option, option, 0, first)) halt_option_ = option;
  }
  if (quick && state_bits_) co_await send_control_pdo(with_halt(*state_bits_));
  bool was_halted = control_ ? (*control_ & control::halt) != 0 : halt_.has_value();
  if (!state_bits_) {
    const auto held = co_await held_control(urgent);
    if (!held) {
      co_await wake_unheard();
      // Whatever is wrong with the reading: it is no refusal of the stop, which was not sent yet.
      auto unheard = held.error();
      unheard.reason = Reason::no_reply;
      co_return fail(std::move(unheard));
    }
    was_halted = (*held & control::halt) != 0;
    state_bits_ = static_cast<std::uint16_t>(*held & control::state_bits);
  }
  const auto bits = *state_bits_;
  auto sent = co_await write_control(with_halt(bits), urgent);
  if (known && quick) co_await zero_velocity(urgent);
  // Under a halt that stands already bit 8 has no edge: what a terminal has started since goes on, and so
  // does the ramp under a quick stop.
  const bool stronger = quick && (!halt_ || !halt_->quick);
  const bool unseen = !halt_ || halt_->rested;
  const bool operates = bits == control_word(Command::enable_operation);
  const bool under_halt = operates && was_halted && (stronger || unseen);
  // 6.2.2: the motor is energised there, too, and a terminal may have started it. Bit 8 means nothing there.
  const bool switched_on = bits == control_word(Command::switch_on);
  if ((under_halt || switched_on) && co_await turns(urgent)) {
    sent = co_await halt_again(bits, urgent);
    if (sent) was_halted = false;
  }
  if (!was_halted) halt_ = Halt{.since = clock_->now(), .quick = quick};
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
  if (!source) co_return last_moving_;
  const auto shown = co_await read_object(*source, std::move(options));
  if (!shown) co_return last_moving_;
  if (bit != 0) co_return (*shown & bit) != 0;
  if (objects.moving || !known_by_way()) co_return *shown != 0;
  const auto rpm = decode_velocity(*model_, setup_.pulses_per_revolution, *shown);
  co_return last_moving_ || std::abs(rpm) > velocity_noise_rpm;
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
                              ? mode_.value_or(neutral) == neutral
                              : bits == control_word(Command::switch_on) && mode_ == neutral;
  if (of_neutral)
    if (auto left = co_await choose_mode_soon(OperationMode::profile_position, options); !left)
      co_return left;
  mode_use_ = ModeUse::neutral;  // before the drive shows it
  if (mode_ != neutral)
    if (auto chosen = co_await choose_mode_soon(neutral, options); !chosen) co_return chosen;
  // Somebody has led the drive elsewhere meanwhile: these bits would lead it back.
  if (state_bits_ && *state_bits_ != bits) co_return Result<void>{};
  co_await send_control_pdo(bits);
  co_await send_control_pdo(word);
  (void)co_await write_control(bits, options);
  co_await send_control_pdo(word);
  co_return co_await write_control(word, std::move(options));
}

}  // namespace axisd::cia402
