#pragma once

#include <deque>
#include <variant>

#include "buses/can/link_tracker.hpp"
#include "buses/can/port.hpp"
#include "buses/can/tx_queue.hpp"

namespace axisd::can {

/// What every port does alike: order and window of what is sent, completions, stall detection, state. What
/// carries the frames derives from it and reports what it sees. Thread: core.
class PortCore : public Port {
 public:
  PortCore(Clock& clock, PortSettings settings);

  void start(PortHandlers handlers) final;
  void send(const Frame& frame, const SendOptions& options, Completion completion) final;
  void purge_superseded(const AxisGate& gate) final;
  void close() final;
  [[nodiscard]] const PortState& state() const final { return tracker_.state(); }
  [[nodiscard]] const PortCounters& counters() const final { return counters_; }
  [[nodiscard]] const PortSettings& settings() const final { return settings_; }

 protected:
  enum class Written : std::uint8_t {
    taken,
    full,  ///< no room now
    lost,  ///< the link is gone: the tracker knows already
  };

  /// Begins to look for the interface.
  virtual void open() = 0;
  /// Lets go of it. Reports nothing any more.
  virtual void shut() = 0;
  /// Hands one frame over, without waiting.
  virtual Written write(const Frame& frame) = 0;
  /// Reports what already happened below. Called before a judgement that depends on it: a core that was late
  /// must not take its own lateness for a stall.
  virtual void catch_up() = 0;
  /// Whether the kernel holds no frame any more. Asked where echoes are no proof.
  virtual bool drained() = 0;
  /// Whether nothing below does, the controller included: what did not come back by then never will. False
  /// also where nobody can tell.
  virtual bool empty_below() = 0;

  void frame_received(const Frame& frame, TimePoint at);
  /// `now`: when it was seen; `at`: its time stamp.
  void own_frame_seen(const Frame& frame, TimePoint at, TimePoint now, bool proof);
  /// Ends what a change of the tracker's state ends, and remembers to tell. After each change.
  void link_changed();
  /// After a batch of reports: sends what may go now, and tells what happened.
  void settle();
  /// Settles when something is due: at once (but not within this call) if there is something to tell.
  void settle_later();

  /// Neither frames of ours are under way, nor does anybody wait for a single one of others.
  [[nodiscard]] bool may_gather() const;
  [[nodiscard]] Clock& clock() const { return *clock_; }
  [[nodiscard]] LinkTracker& tracker() { return tracker_; }
  [[nodiscard]] PortCounters& counts() { return counters_; }
  [[nodiscard]] bool closed() const { return closed_; }

 private:
  void pump();
  void collect();
  void tell();
  void on_timer();

  Clock* clock_;
  PortSettings settings_;
  PortHandlers handlers_;
  PortCounters counters_;
  TxQueue queue_;
  LinkTracker tracker_;
  std::optional<PortState> known_;  ///< last state that was put into events_
  std::deque<std::variant<TxQueue::Ended, ReceivedFrame, PortState>> events_;  ///< to tell, in order
  Clock::Timer timer_;
  bool closed_ = false;
};

}  // namespace axisd::can
