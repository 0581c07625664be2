// What the master knows of the words that stand in a drive: control word, mode, kind of halt.
#pragma once

#include <cstdint>
#include <optional>

#include "buses/clock.hpp"
#include "devices/cia402/objects.hpp"
#include "devices/cia402/status_word.hpp"

namespace axisd::cia402 {

/// Pure. Thread: core. A word is known once the drive has confirmed or shown it, for a second, and as long as
/// the port was not lost: another master may have changed it unseen, and state bits of before would energise
/// a drive that somebody has released meanwhile (M1).
///
/// The control word (Control). A state that the drive shows tells bits 0 to 3; most words do not change them.
///
///   any    -- confirm(), take_read() ---------------------------------> whole
///   whole  -- begin_write(), bits 0 to 3 stay; doubt_control() --------> state_bits
///   any    -- begin_write() with other bits --------------------------> unknown
///   any    -- see_state(), Switched On or Enabled, not that of the word -> state_bits
///   any    -- see_state(), another one than that of word or bits -----> unknown
///   any    -- take_bits() --------------------------------------------> state_bits, or more
///   any    -- forget() -----------------------------------------------> unknown
///
/// The halt (bit 8), by its last edge (Halt):
///
///   any     -- halted() ---------------------------------------> braking
///   braking -- see_rest() -------------------------------------> rested
///   any     -- executed(), a word without it; forget_halt() ---> none
class KnownWords {
 public:
  enum class Control : std::uint8_t { unknown, state_bits, whole };
  enum class Halt : std::uint8_t { none, braking, rested };
  /// What the mode that is set was chosen for.
  enum class ModeUse : std::uint8_t { motion, neutral };
  /// Number of a write: a later one has another.
  using Write = std::uint64_t;
  /// When something was known, and how often the port had been lost until then.
  struct Moment {
    TimePoint at{};
    std::uint64_t losses = 0;
  };

  explicit KnownWords(OperationMode neutral_mode) : neutral_mode_(neutral_mode) {}

  /// All but the halt.
  void forget();
  /// The same, if nothing has proven it lately.
  void forget_stale(Moment now);
  /// The drive shows this state, asked for at this moment.
  void see_state(State shown, Moment asked);

  // The control word.
  /// Whoever asks meanwhile must not go by what stood there before; but bits 0 to 3 that are the same before
  /// and after stand there whether it is executed or not. Nothing: the word waits in the drive for a SYNC, or
  /// nobody knows which of several it will be; bits 0 to 3 stay.
  Write begin_write(std::optional<std::uint16_t> word);
  void end_write(TimePoint at);
  /// It was, or may have been.
  void executed(std::uint16_t word);
  /// The drive has confirmed it. Precondition: is_newest().
  void confirm(std::uint16_t word, Moment at);
  [[nodiscard]] bool is_newest(Write write) const { return write == writes_; }
  [[nodiscard]] Write newest() const { return writes_; }
  /// What the drive answered; nothing is learned where something was written since `newest`, or is being
  /// written.
  void take_read(std::uint16_t word, Write newest, Moment asked);
  /// It has to be read again.
  void doubt_control() { control_.reset(); }
  /// Bits 0 to 3 as the drive was seen to hold them.
  void take_bits(std::uint16_t bits) { bits_ = bits; }
  [[nodiscard]] const std::optional<std::uint16_t>& control() const { return control_; }
  [[nodiscard]] const std::optional<std::uint16_t>& state_bits() const { return bits_; }
  [[nodiscard]] Control knows() const;

  // Halt.
  /// `quick`: without a ramp.
  void halted(TimePoint at, bool quick);
  /// The motor rests, by a reading that was asked for then.
  void see_rest(TimePoint asked_at);
  void forget_halt() { halt_ = Halt::none; }
  [[nodiscard]] Halt halt() const { return halt_; }
  [[nodiscard]] bool halt_is_quick() const { return halt_ != Halt::none && halt_quick_; }
  /// Bit 8 stood in the drive when it was asked.
  [[nodiscard]] bool held_halt(TimePoint asked_at) const;
  /// 605Dh. Nothing: unknown.
  [[nodiscard]] const std::optional<std::int16_t>& halt_option() const { return halt_option_; }
  void set_halt_option(std::optional<std::int16_t> option) { halt_option_ = option; }

  // Mode of operation (6061h).
  void leave_mode() { mode_.reset(); }
  void mode_written(TimePoint at) { mode_at_ = at; }
  /// The drive is in it.
  void mode_reached(OperationMode mode, TimePoint at);
  /// A reading that was asked for then. Nothing: it does not have the mode.
  void see_mode(std::optional<OperationMode> shown, TimePoint asked_at);
  /// Before the drive shows it.
  void use_mode(ModeUse use) { mode_use_ = use; }
  [[nodiscard]] const std::optional<OperationMode>& mode() const { return mode_; }
  [[nodiscard]] ModeUse mode_use() const { return mode_use_; }
  /// A motion's, by what is known.
  [[nodiscard]] bool homes() const { return mode_ == OperationMode::homing && mode_use_ != ModeUse::neutral; }
  /// A reading that was asked for then may be of the neutral mode, or of the way there or back.
  [[nodiscard]] bool may_be_neutral(TimePoint asked_at) const;

 private:
  void prove(Moment at);

  OperationMode neutral_mode_;
  std::optional<std::uint16_t> control_, bits_;
  Write writes_ = 0;
  int writing_ = 0;
  TimePoint written_at_{};  ///< when a write ended last
  Moment proven_{};
  Halt halt_ = Halt::none;
  TimePoint halt_since_{};
  bool halt_quick_ = false;
  std::optional<std::int16_t> halt_option_;
  std::optional<OperationMode> mode_;
  TimePoint mode_at_ = TimePoint::min();  ///< when it was written, or reached, last
  ModeUse mode_use_ = ModeUse::motion;
};

}  // namespace axisd::cia402
