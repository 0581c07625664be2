#include "devices/cia402/known_words.hpp"

#include <algorithm>

namespace axisd::cia402 {

namespace {

using std::chrono::milliseconds;

constexpr auto proof_lasts = milliseconds(1000);
/// A drive that shows another mode for longer is not on its way to one that it was told.
constexpr auto longest_mode_change = milliseconds(500);

std::uint16_t bits_of(std::uint16_t word) { return static_cast<std::uint16_t>(word & control::state_bits); }

/// The state in which a drive rests that follows this control word.
State state_after(std::uint16_t word) {
  const auto bits = bits_of(word);
  if (bits == control_word(ControlCommand::enable_operation)) return State::operation_enabled;
  if (bits == control_word(ControlCommand::switch_on)) return State::switched_on;
  return bits == control_word(ControlCommand::shutdown) ? State::ready_to_switch_on
                                                        : State::switch_on_disabled;
}

}  // namespace

void KnownWords::forget() {
  control_.reset();
  bits_.reset();
  mode_.reset();
  mode_use_ = ModeUse::motion;
  halt_option_.reset();
}

void KnownWords::forget_stale(Moment now) {
  const bool proven = now.at - proven_.at <= proof_lasts && proven_.losses == now.losses;
  if (!proven) forget();
}

void KnownWords::prove(Moment at) { proven_ = {.at = std::max(proven_.at, at.at), .losses = at.losses}; }

void KnownWords::see_state(State shown, Moment asked) {
  if (writing_ > 0 || asked.at <= written_at_) return;
  if (control_ && state_after(*control_) != shown) control_.reset();
  // Whatever led there: with these bits it stays there.
  if (shown == State::operation_enabled)
    bits_ = control_word(ControlCommand::enable_operation);
  else if (shown == State::switched_on)
    bits_ = control_word(ControlCommand::switch_on);
  else if (bits_ && state_after(*bits_) != shown)
    bits_.reset();
  prove(asked);
}

KnownWords::Write KnownWords::begin_write(std::optional<std::uint16_t> word) {
  control_.reset();
  if (word && bits_ != bits_of(*word)) bits_.reset();
  ++writing_;
  return ++writes_;
}

void KnownWords::end_write(TimePoint at) {
  --writing_;
  written_at_ = at;
}

void KnownWords::executed(std::uint16_t word) {
  if ((word & control::halt) == 0) halt_ = Halt::none;
}

void KnownWords::confirm(std::uint16_t word, Moment at) {
  control_ = word;
  bits_ = bits_of(word);
  prove(at);
}

void KnownWords::take_read(std::uint16_t word, Write newest, Moment asked) {
  if (writing_ == 0 && is_newest(newest)) confirm(word, asked);
}

KnownWords::Control KnownWords::knows() const {
  if (control_) return Control::whole;
  return bits_ ? Control::state_bits : Control::unknown;
}

void KnownWords::halted(TimePoint at, bool quick) {
  halt_ = Halt::braking;
  halt_since_ = at;
  halt_quick_ = quick;
}

void KnownWords::see_rest(TimePoint asked_at) {
  if (halt_ == Halt::braking && asked_at >= halt_since_) halt_ = Halt::rested;
}

bool KnownWords::held_halt(TimePoint asked_at) const {
  const bool by_edge = halt_ != Halt::none && asked_at >= halt_since_;
  const bool as_found = control_ && (*control_ & control::halt) != 0 && asked_at >= written_at_;
  return by_edge || as_found;
}

void KnownWords::mode_reached(OperationMode mode, TimePoint at) {
  mode_ = mode;
  mode_at_ = at;
  if (mode != neutral_mode_) mode_use_ = ModeUse::motion;
}

void KnownWords::see_mode(std::optional<OperationMode> shown, TimePoint asked_at) {
  if (shown && asked_at > mode_at_) mode_ = shown;
  if (mode_ && *mode_ != neutral_mode_ && asked_at > mode_at_ + longest_mode_change)
    mode_use_ = ModeUse::motion;
}

bool KnownWords::may_be_neutral(TimePoint asked_at) const {
  return mode_use_ == ModeUse::neutral || asked_at <= mode_at_;
}

}  // namespace axisd::cia402
