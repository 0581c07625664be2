// A CAN network in this process: for `interface: sim`, and for tests in virtual time.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>

#include "buses/can/port_core.hpp"

namespace axisd::can {

/// Carries one frame at a time, as long as it takes at the bit rate (with all stuff bits), the lowest id
/// first. What is transmitted comes to every other participant at its end. Thread: core.
class Network {
 public:
  using Id = int;  ///< of a participant
  /// A frame ended. `own`: it is the participant's, which is thereby confirmed.
  using Receiver = std::function<void(const Frame& frame, TimePoint at, bool own)>;

  /// What happens to one frame; its sender sees it confirmed all the same.
  struct Fault {
    bool drop = false;  ///< nobody receives it
    Duration delay{};   ///< it is received later by this; others may overtake it
  };

  Network(Clock& clock, std::uint32_t bitrate) : clock_(&clock), bitrate_(bitrate) {}
  Network(const Network&) = delete;

  Id join(Receiver receiver);
  /// What the participant had still to transmit is gone; a frame on the wire ends.
  void leave(Id participant);
  /// Queues behind the participant's earlier frames. Precondition: valid(frame).
  void transmit(Id participant, const Frame& frame);
  /// Empties the participant's queue; a frame on the wire ends.
  void flush(Id participant);
  [[nodiscard]] std::size_t waiting(Id participant) const;

  /// Asked for each frame when it begins; none: no faults.
  void set_fault(std::function<Fault(const Frame&)> fault) { fault_ = std::move(fault); }
  /// Nobody acknowledges: nothing is transmitted until this ends, and then all that still waits is.
  void set_stalled(bool stalled);

  [[nodiscard]] Duration frame_time(const Frame& frame) const;
  [[nodiscard]] std::uint32_t bitrate() const { return bitrate_; }
  [[nodiscard]] std::uint64_t frames() const { return frames_; }  ///< transmitted since start

 private:
  struct Participant {
    Receiver receiver;
    std::deque<Frame> queue;
  };
  void arbitrate();
  void finish(Id sender, const Frame& frame, Fault fault);
  void deliver(Id sender, const Frame& frame, TimePoint at);

  Clock* clock_;
  std::uint32_t bitrate_;
  std::map<Id, Participant> participants_;
  Id last_id_ = 0;
  std::function<Fault(const Frame&)> fault_;
  bool stalled_ = false;
  std::uint64_t frames_ = 0;
  Clock::Timer busy_;  ///< ends with the frame on the wire
  bool on_wire_ = false;
  std::map<std::uint64_t, Clock::Timer> delayed_;
  std::uint64_t last_delayed_ = 0;
};

/// A port on a Network that outlives it. Its interface is up from the start on, unless faults are set.
/// Thread: core.
class NetworkPort final : public PortCore {
 public:
  NetworkPort(Clock& clock, PortSettings settings, Network& network);
  ~NetworkPort() override { shut(); }

  /// The interface was set down or up; down empties its queue.
  void set_up(bool up);
  /// The interface was removed; set_up() creates it anew.
  void remove();
  /// The controller says so. After bus_off what is written vanishes, as with the kernel, until the link was
  /// cycled.
  void report(Controller controller);
  /// Takes the link down and up, as it takes privileges with a real interface.
  void cycle();

 private:
  void open() override;
  void shut() override;
  Written write(const Frame& frame) override;
  void catch_up() override {}  // the network reports at once
  void leave();

  static constexpr std::size_t interface_queue = 10;  ///< as txqueuelen of a CAN interface

  Network* network_;
  Network::Id id_ = 0;  ///< 0: not on the network
  bool present_ = true, wanted_up_ = true;
  bool open_ = false;
};

}  // namespace axisd::can
