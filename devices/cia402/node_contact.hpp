// How far the contact with a node has come, and what it says of itself: boot-up, heartbeat, EMCY.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "buses/clock.hpp"

namespace axisd::cia402 {

/// Pure. Thread: core. Three things that do not follow from each other: how far the contact is, whether the
/// drive's memory was lost, and whether its heartbeat comes.
class NodeContact {
 public:
  /// A first question is asked: what is known of the power cycle before is forgotten already.
  void begin();
  /// Nothing waits in it for a SYNC.
  void settle() { settled_ = true; }
  /// `needed`: the driver goes by what the drive's memory held.
  void booted(bool needed);
  /// It has lost its memory, and nobody was told yet.
  [[nodiscard]] bool rebooted() const { return rebooted_; }
  [[nodiscard]] bool is_settled() const { return settled_; }

  void note_heartbeat(bool lost) { heartbeat_lost_ = lost; }
  /// Its PDOs are not waited for.
  [[nodiscard]] bool heartbeat_lost() const { return heartbeat_lost_; }

  /// It was told to start, since begin(); a node without heartbeat does not say what it is.
  void note_started(bool started) { started_ = started; }
  [[nodiscard]] bool started() const { return started_; }

  /// It did not answer to the first question.
  void note_silence(TimePoint at) {
    if (!silent_since_) silent_since_ = at;
  }
  void note_answer() { silent_since_.reset(); }
  /// Since it was silent first, or was heard last.
  [[nodiscard]] Duration silent_for(TimePoint now, std::optional<TimePoint> heard) const;

  /// An EMCY told of it. It may be gone before it is read (M5).
  void note_alarm(std::uint16_t alarm) { pending_alarm_ = alarm; }
  /// It is told on: once. 0: none.
  [[nodiscard]] std::uint16_t take_alarm() { return std::exchange(pending_alarm_, std::uint16_t{0}); }
  [[nodiscard]] bool has_alarm() const { return pending_alarm_ != 0; }
  /// By a reset of ours, or as its EMCY told.
  void note_fault_left(TimePoint at) { fault_left_at_ = at; }
  /// A fault that was asked for then is none any more.
  [[nodiscard]] bool has_left_fault_since(TimePoint asked_at) const { return asked_at < fault_left_at_; }

 private:
  bool settled_ = false, rebooted_ = false, heartbeat_lost_ = false, started_ = false;
  std::optional<TimePoint> silent_since_;
  std::uint16_t pending_alarm_ = 0;
  TimePoint fault_left_at_{};
};

}  // namespace axisd::cia402
