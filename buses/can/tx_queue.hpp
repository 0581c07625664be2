#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "buses/can/port.hpp"

namespace axisd::can {

/// What one port has still to send and what it waits to see confirmed. Pure: no I/O, no clock of its own, and
/// it calls nobody; ended frames are taken out with take_ended(). Thread: core.
///
/// A frame is bound late: class, guard and deadline are looked at when it is handed over, so that what waits
/// here is never out of date. A stop does not get past the window: what the kernel holds goes first anyway.
class TxQueue {
 public:
  struct Ended {
    SendResult result;
    Completion completion;
  };

  explicit TxQueue(const PortSettings& settings)
      : window_(settings.window), limit_(settings.queue_limit), stall_timeout_(settings.stall_timeout) {}

  /// Queues a frame; at once `invalid` or `queue_full` where it cannot be.
  void push(const Frame& frame, const SendOptions& options, Completion completion);
  /// The frame to hand over now, or none (nothing waits, the window is full, the kernel was full just before,
  /// or a frame is overdue and no stop waits). Valid until the next call.
  const Frame* next(TimePoint now);
  /// The kernel took what next() gave.
  void handed_over(TimePoint now);
  /// The kernel's queue was full (ENOBUFS): next() gives nothing for a while. poll(2) is no help: it says
  /// writable.
  void no_buffer(TimePoint now);

  /// An own frame came back, with its time stamp. `proof`: seeing it means that the network took it; else the
  /// frame is confirmed by drained(). False: nobody waits for it.
  bool echo(const Frame& frame, TimePoint at, TimePoint now, bool proof = true);
  /// The kernel holds no frame of ours any more: whatever came back is sent.
  void drained(TimePoint now);
  /// Something came back that is no proof: ask the kernel whether it still holds frames.
  [[nodiscard]] bool awaits_drain() const;
  /// A frame has not come back for stall_timeout, though others may have: ask the kernel, too.
  [[nodiscard]] bool overdue(TimePoint now) const;
  /// Neither the kernel nor the controller holds a frame of ours any more, and all that came back was seen:
  /// what is overdue will not come back. It ends as `unknown`: its echo was lost, or the controller lost the
  /// frame.
  void give_up_overdue(TimePoint now);

  /// Ends queued frames whose deadline or validity has passed.
  void reap(TimePoint now);
  /// Ends the queued frames that `gate` guards and that may not be sent any more. Looks at no others.
  void purge_superseded(const AxisGate& gate, TimePoint now);
  /// The port cannot send any more: queued frames end as `port_down`, unconfirmed ones as `unknown`.
  void end_all();

  /// Neither a confirmation nor room in the kernel's queue for stall_timeout, or a frame that may still be
  /// held below after twice that time.
  [[nodiscard]] bool stalled(TimePoint now) const;
  /// When next(), reap(), stalled() or awaits_drain() should be looked at again; TimePoint::max(): no need.
  [[nodiscard]] TimePoint next_event() const;
  std::vector<Ended> take_ended();
  [[nodiscard]] std::size_t queued() const;
  [[nodiscard]] std::size_t unconfirmed() const { return unconfirmed_.size(); }

 private:
  struct Waiting {
    Frame frame;
    SendOptions options;
    Completion completion;
  };
  struct Unconfirmed {
    Frame frame;
    Completion completion;
    TimePoint handed_over;
    bool echoed = false;
  };
  using Lane = std::list<Waiting>;
  using Place = Lane::iterator;

  static SendStatus judge(const Waiting& waiting, TimePoint now);
  void end(Completion completion, SendResult result);
  void confirm(const std::deque<Unconfirmed>::iterator& which, TimePoint at, TimePoint now);
  Lane* first_lane();
  Waiting take(Place place);
  void forget_refusal();
  /// When the frame that waits for its echo for longest was handed over; TimePoint::max(): none waits.
  [[nodiscard]] TimePoint oldest() const;
  [[nodiscard]] TimePoint stalls_at() const;

  std::size_t window_;
  std::size_t limit_;
  Duration stall_timeout_;
  std::array<Lane, transaction_class_count> lanes_;
  // Where everything is that one gate guards, and what ends by itself.
  std::unordered_map<const AxisGate*, std::vector<Place>> guarded_;
  std::multimap<TimePoint, Place> ends_;
  std::deque<Unconfirmed> unconfirmed_;  ///< in the order of handing over
  std::vector<Ended> ended_;
  TimePoint progress_{};                    ///< last confirmation, or the hand-over that began the waiting
  TimePoint looked_at_{};                   ///< last time that a drain was waited for
  TimePoint retry_at_{};                    ///< the kernel was full: not before
  Duration back_off_{};                     ///< of the next ENOBUFS
  std::optional<TimePoint> refused_since_;  ///< first ENOBUFS without room since
};

}  // namespace axisd::can
