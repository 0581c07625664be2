// A start that no reading has shown yet: its drive may begin although it has acknowledged a stop (M13, M14).
#pragma once

#include <cstdint>

#include "buses/clock.hpp"

namespace axisd {

/// No manual says what a stop does between a start's acknowledgement and the motor's first pulse: 7.6.2
/// speaks of the moving motor. A drive may acknowledge it, and begin then. Until the start was seen, or is
/// too old, rest is no standstill, and a motion that begins is stopped again. Pure. Thread: core.
///
///   none            -- sending() ---------------------------------------> sending
///   sending         -- sent(), left() ----------------------------------> unseen
///   sending, unseen -- not_sent(), restarted() -------------------------> none
///   sending, unseen -- look(): moves, or is elsewhere ------------------> none
///   unseen          -- look(): rests, asked after the start window -----> none
class UnseenStart {
 public:
  enum class State : std::uint8_t {
    none,
    sending,  ///< its trigger may be with the bus
    unseen,   ///< it was sent, or may have been
  };
  struct Reading {
    TimePoint asked_at{};
    bool moving = false;
    bool elsewhere = false;  ///< than at base()
  };

  /// From `now` on a start may be sent; the shaft is at `base`. Returns what names it to sent() and
  /// not_sent(), which do nothing for one that is not the newest.
  int sending(std::int64_t base, TimePoint now);
  /// What became of it is told at `now`: it was sent, or nobody knows.
  void sent(int start, TimePoint now);
  /// It is known that it was not.
  void not_sent(int start);
  /// Its command has ended; from `now` on the gate lets nothing of it out.
  void left(TimePoint now);
  /// The drive has forgotten it.
  void restarted() { state_ = State::none; }
  /// True: the motion has just been seen under way for the first time. What was asked for before sending()
  /// says nothing.
  [[nodiscard]] bool look(const Reading& reading);

  [[nodiscard]] State state() const { return state_; }
  /// A drive at rest may begin yet.
  [[nodiscard]] bool may_begin() const { return state_ != State::none; }
  [[nodiscard]] std::int64_t base() const { return base_; }
  /// How many were seen to begin.
  [[nodiscard]] int begun() const { return begun_; }

 private:
  void wait_from(TimePoint now);

  State state_ = State::none;
  int starts_ = 0;
  int begun_ = 0;
  TimePoint since_{};
  std::int64_t base_ = 0;  ///< pulses
  TimePoint until_{};
};

}  // namespace axisd
