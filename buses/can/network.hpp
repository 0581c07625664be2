// A CAN network in this process: for `interface: sim`, and for tests in virtual time.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "buses/can/port_core.hpp"

namespace axisd::can {

/// Carries one frame at a time, as long as it takes at the bit rate (with all stuff bits), the lowest id
/// first. What is transmitted comes to every other participant at its end.
///
/// Its time is the wire's: a frame that follows another begins where that one ended, and a frame begins when
/// its node had it ready, however late the host runs the callbacks. A slow host is told late of what happened
/// on the wire, but makes the wire no slower. Thread: core.
class Network {
 public:
  using Id = int;  ///< of a participant
  /// A frame ended, at `at` on the wire. `own`: it is the participant's, which is thereby confirmed.
  using Receiver = std::function<void(const Frame& frame, TimePoint at, bool own)>;

  /// What happens to one frame.
  struct Fault {
    bool drop = false;         ///< nobody receives it; its sender sees it confirmed all the same
    Duration delay{};          ///< it is received later by this; others may overtake it
    bool unconfirmed = false;  ///< its sender does not see it confirmed
  };

  Network(Clock& clock, std::uint32_t bitrate) : clock_(&clock), bitrate_(bitrate) {}
  Network(const Network&) = delete;

  Id join(Receiver receiver);
  /// What the participant had still to transmit is gone; a frame on the wire ends.
  void leave(Id participant);
  /// Queues behind the participant's earlier frames. Precondition: valid(frame).
  void transmit(Id participant, const Frame& frame) { transmit(participant, frame, clock_->now()); }
  /// The same for a simulated node that had the frame ready at `ready`, which a late host may be past.
  void transmit(Id participant, const Frame& frame, TimePoint ready);
  /// Empties the participant's queue; a frame on the wire ends.
  void flush(Id participant);
  [[nodiscard]] std::size_t waiting(Id participant) const;
  /// A frame of the participant's waits, or is on the wire.
  [[nodiscard]] bool holds_frame_of(Id participant) const {
    return waiting(participant) > 0 || (on_wire_ && on_wire_->sender == participant);
  }

  /// Asked for each frame when it begins; none: no faults.
  void set_fault(std::function<Fault(const Frame&)> fault) { fault_ = std::move(fault); }
  /// Nobody acknowledges: nothing is transmitted until this ends, and then all that still waits is.
  void set_stalled(bool stalled);
  /// Carries at once what has ended on the wire until `now`, and would be carried as soon as the host runs
  /// the callbacks that are due.
  void catch_up(TimePoint now);

  [[nodiscard]] Duration frame_time(const Frame& frame) const;
  [[nodiscard]] std::uint32_t bitrate() const { return bitrate_; }
  [[nodiscard]] std::uint64_t frames() const { return frames_; }  ///< transmitted since start

 private:
  struct Waiting {
    Frame frame;
    TimePoint ready;
  };
  struct Participant {
    Receiver receiver;
    std::deque<Waiting> queue;
  };
  struct OnWire {
    Id sender;
    Frame frame;
    Fault fault;
    TimePoint ends;
  };
  void arbitrate(TimePoint at);
  void finish();
  void deliver(Id sender, const Frame& frame, TimePoint at);

  Clock* clock_;
  std::uint32_t bitrate_;
  std::map<Id, Participant> participants_;
  Id last_id_ = 0;
  std::function<Fault(const Frame&)> fault_;
  bool stalled_ = false;
  std::uint64_t frames_ = 0;
  std::optional<OnWire> on_wire_;
  TimePoint free_since_{};  ///< end of the last frame
  Clock::Timer next_;       ///< end of the frame on the wire, else when the next may begin
  std::map<std::uint64_t, Clock::Timer> delayed_;
  std::uint64_t last_delayed_ = 0;
};

/// A port on a Network that outlives it. Its interface is up from the start on, unless faults are set.
/// Thread: core.
class NetworkPort : public PortCore {
 public:
  NetworkPort(Clock& clock, PortSettings settings, Network& network);
  ~NetworkPort() override { shut(); }

  /// The interface was set down or up; down empties its queue. Up changes nothing where it is up.
  void set_up(bool up);
  /// The interface was removed; set_up() creates it anew.
  void remove();
  /// The controller says so. After bus_off what is written vanishes, as with the kernel, until the link was
  /// cycled.
  void report(Controller controller);
  /// True: this interface is the process's own.
  bool cycle() override;

 protected:
  Written write(const Frame& frame) override;

 private:
  void open() final;
  void shut() final;
  void catch_up() override { network_->catch_up(clock().now()); }
  bool drained() override { return !network_->holds_frame_of(id_); }
  bool empty_below() override { return drained(); }
  void leave();

  static constexpr std::size_t interface_queue = 10;  ///< as txqueuelen of a CAN interface

  Network* network_;
  Network::Id id_ = 0;  ///< 0: not on the network
  bool present_ = true, wanted_up_ = true;
  bool open_ = false;
};

}  // namespace axisd::can
