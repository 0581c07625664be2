// How far a group move has come (M22).
#pragma once

#include <cstdint>

namespace axisd {

/// The way of a group move. One that starts when told goes by `prepared`. Pure. Thread: core.
///
///   preparing -- begin() --------> starting     it starts at once
///   preparing -- prepared() -----> prepared     it starts when told
///   prepared --- told() ---------> told
///   told ------- all_told() -----> due
///   due -------- begin() --------> starting
///   starting --- all_started() --> following
///   any -------- give_up() ------> given_up
class GroupMachine {
 public:
  enum class State : std::uint8_t {
    preparing,  ///< all that could forbid a start is looked at
    prepared,   ///< its members wait to be told; it expires by itself
    told,       ///< its moment is known; whether its other machines know theirs is not
    due,        ///< all know theirs; its moment is not near yet
    starting,   ///< from the last look on; starts may have been sent
    following,  ///< all members have started
    given_up,   ///< something at one member has ended it for all
  };

  void prepared() { go(State::preparing, State::prepared); }
  void told() { go(State::prepared, State::told); }
  void all_told() { go(State::told, State::due); }
  void begin() {
    state_ == State::preparing ? go(State::preparing, State::starting) : go(State::due, State::starting);
  }
  void all_started() { go(State::starting, State::following); }
  void give_up() { state_ = State::given_up; }

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool given_up() const { return state_ == State::given_up; }
  /// It was told to start, and is not given up: whoever told it has to renew it.
  [[nodiscard]] bool runs() const { return state_ >= State::told && !given_up(); }

 private:
  void go(State from, State to) {
    if (state_ == from) state_ = to;
  }
  State state_ = State::preparing;
};

}  // namespace axisd
