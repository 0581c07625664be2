// What a command waits for before its start, and whether its start may have been sent (M31).
#pragma once

#include <cstdint>

namespace axisd {

/// The way of a command to its start. A command of its own goes from `accepted` to `ready` with standstill(),
/// a member of a group with about_to_start(), and one that starts no motion never does. Homing that backs off
/// goes its way twice: its first motion has begun when it saves again. Pure. Thread: core.
///
///   accepted -- wait_for_halt() ----------------> halting
///   accepted, halting, ready -- standstill() ---> ready
///   accepted, halting -- note() ----------------> noting;  noted() leads to accepted
///   ready -- note() ----------------------------> noting;  noted() leads to ready
///   accepted -- save() -------------------------> noting;  saved() leads to accepted
///   ready, begun -- save() ---------------------> saving;  saved() leads to ready
///   accepted -- queue() ------------------------> queued;  has_turn() leads to accepted
///   ready, begun -- queue() --------------------> queued;  has_turn() leads to ready
///   accepted -- set_down() ---------------------> set_down;  take_up() leads to accepted
///   accepted -- about_to_start() ---------------> ready
///   ready -- not_started() ---------------------> accepted
///   ready -- begun() ---------------------------> begun
class StartMachine {
 public:
  enum class State : std::uint8_t {
    accepted,  ///< nothing is sent for it yet; or it starts no motion
    halting,   ///< waits for the end of the motion before it (M9)
    noting,    ///< waits for the disk; nothing of it is sent before
    queued,    ///< waits for the starts of other axes on its bus that asked before it
    set_down,  ///< all is looked at: waits to be told when to start
    saving,    ///< waits for the disk, and its ramps may be the drive's already
    ready,     ///< its frames may be with the bus, whose gate decides
    begun,     ///< its start was sent
  };

  void wait_for_halt() { state_ = State::halting; }
  void standstill() { state_ = State::ready; }
  /// The command is made known to a restart of the daemon. False: it was before.
  [[nodiscard]] bool note();
  void noted() { go_back(); }
  /// Something else has to be on the disk first.
  void save() { state_ = may_run() ? State::saving : State::noting; }
  void saved() { state_ = may_run() ? State::ready : State::accepted; }
  void queue() { leave_for(State::queued); }
  void has_turn() { go_back(); }
  void set_down() { state_ = State::set_down; }
  void take_up() { state_ = State::accepted; }
  void about_to_start() { state_ = State::ready; }
  void not_started() { state_ = State::accepted; }
  void begun() { state_ = State::begun; }

  [[nodiscard]] State state() const { return state_; }
  /// Its start may have been sent: its ramps are the drive's.
  [[nodiscard]] bool may_run() const { return state_ >= State::saving; }
  [[nodiscard]] bool has_begun() const { return state_ == State::begun; }
  /// Until its drive's turn, or moment, has come there is nothing to be read often.
  [[nodiscard]] bool bides() const { return state_ == State::queued || state_ == State::set_down; }
  /// Nothing of it is with its bus before it has what it waits for: what moves meanwhile is not of it.
  [[nodiscard]] bool sends_nothing() const {
    return state_ == State::noting || state_ == State::queued || state_ == State::set_down ||
           state_ == State::saving;
  }
  /// It is known to a restart, or that is under way.
  [[nodiscard]] bool is_noted() const { return noted_; }
  /// It waits for something else than its line, whose gate ends what is late.
  [[nodiscard]] bool waits() const {
    return state_ != State::accepted && state_ != State::ready && state_ != State::begun;
  }

 private:
  void leave_for(State state) {
    may_run_after_ = may_run();
    state_ = state;
  }
  void go_back() { state_ = may_run_after_ ? State::ready : State::accepted; }

  State state_ = State::accepted;
  bool may_run_after_ = false;  ///< may_run(), once it has what it waits for
  bool noted_ = false;
};

inline bool StartMachine::note() {
  if (noted_) return false;
  noted_ = true;
  leave_for(State::noting);
  return true;
}

}  // namespace axisd
