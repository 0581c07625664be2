// A motion that no command explains: does a terminal of the drive move it?
#pragma once

#include <cstdint>

namespace axisd {

/// Tells a motion that a terminal of the drive has started (M1: it is left alone) from one that nobody knows
/// (M4: it is stopped). Pure. Thread: core.
///
///   none        -- judge(): shown by the drive or a terminal --------> by_terminal
///   none        -- judge(): a terminal may show one reading later ---> none, and the next reading decides
///   none        -- judge(): else ------------------------------------> none, and it is to be stopped
///   by_terminal -- judge() ------------------------------------------> by_terminal
///   by_terminal -- at_rest(), lost() --------------------------------> none
class TerminalMotion {
 public:
  enum class State : std::uint8_t { none, by_terminal };
  enum class Verdict : std::uint8_t {
    known,       ///< nothing new
    look_again,  ///< motion and terminals may come in different frames
    begins,      ///< a terminal moves it
    nobodys,     ///< stop it
  };
  /// A reading of a motion without a command.
  struct Motion {
    bool told_to_stop = false;     ///< and has not confirmed it: what moves is never a terminal's
    bool terminals_start = false;  ///< some terminal is configured to start motions
    bool just_began = false;       ///< the reading before shows it at rest
    bool shown = false;            ///< by the drive's mode, or by a terminal that is, or just was, active
    bool by_itself = false;        ///< the drive takes its motion from elsewhere, as it is configured
  };

  Verdict judge(const Motion& motion);
  void at_rest() { state_ = State::none; }
  /// Nobody can say any more.
  void lost() { state_ = State::none; }

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool moves() const { return state_ == State::by_terminal; }

 private:
  State state_ = State::none;
};

}  // namespace axisd
