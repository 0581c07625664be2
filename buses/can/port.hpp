// The seam between whoever speaks on a CAN network and what carries the frames: SocketCAN, or a network in
// this process.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "buses/gate.hpp"
#include "buses/transaction.hpp"

namespace axisd::can {

/// One classic CAN frame.
struct Frame {
  std::uint32_t id = 0;                ///< 0..0x7FF, extended 0..0x1FFFFFFF
  bool extended = false;               ///< 29-bit id
  bool rtr = false;                    ///< remote request: `size` is asked for, `data` is all 0
  std::uint8_t size = 0;               ///< 0..8
  std::array<std::uint8_t, 8> data{};  ///< behind `size` all 0, so that equal frames compare equal

  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return std::span(data).first(size); }
  friend bool operator==(const Frame&, const Frame&) = default;
};

/// A data frame with an 11-bit id. Precondition: id <= 0x7FF, at most 8 bytes.
Frame make_frame(std::uint32_t id, std::span<const std::uint8_t> bytes);
/// Id and size are in range and unused bytes are 0.
bool valid(const Frame& frame);
/// As candump writes it: "601#4041600000000000", "00000123#R", "18FF0102#0011" (8 digits: 29-bit).
std::string to_string(const Frame& frame);
/// Bits on the wire at most (with all stuff bits and the 3 of interframe space).
int worst_case_bits(const Frame& frame);
/// How long they take. Precondition: bit_rate > 0, in bit/s.
Duration worst_case_time(const Frame& frame, std::uint32_t bit_rate);

struct ReceivedFrame {
  Frame frame;
  TimePoint at;  ///< end of the frame, as precise as the network reports it
};

/// How and when a frame may go out.
struct SendOptions {
  /// Strict order, first in first out within a class; a stop goes before everything that is queued here.
  TransactionClass transaction_class = TransactionClass::parameters;
  TimePoint deadline = TimePoint::max();   ///< not handed to the kernel after this
  MotionGuard guard{};                     ///< for motion frames: asked when the frame is handed over
  std::vector<MotionGuard> more_guards{};  ///< all have to allow it: a frame that starts several axes
};

/// How a frame ended. All but `sent` and `unknown`: not a bit of it reached the network, nor ever will.
enum class SendStatus : std::uint8_t {
  sent,        ///< the network took it: its echo came back
  superseded,  ///< the epoch of its axis rose before it was handed over
  expired,     ///< its deadline or validity passed before it was handed over
  lease_lost,  ///< the lease that it was given under is gone
  port_down,   ///< the port could not send, or stopped to be able before the frame was handed over
  queue_full,  ///< too many frames wait already
  invalid,     ///< not a CAN frame
  unknown,     ///< handed over, but its echo never came: it may have been sent
};
std::string_view to_string(SendStatus status);

struct SendResult {
  SendStatus status = SendStatus::unknown;
  TimePoint handed_over{};  ///< `sent` and `unknown`
  TimePoint sent_at{};  ///< `sent`: time stamp of the echo (the end of the frame where the controller echoes)
};
using Completion = std::function<void(const SendResult&)>;

/// What a caller is told about a frame that was not sent, or perhaps not. Precondition: status is not `sent`.
Error error_of(const SendResult& result, const std::string& bus, const Frame& frame);

enum class InterfaceState : std::uint8_t {
  removed,        ///< there is no such interface
  down,           ///< the interface is down, or up with settings that forbid using it (`error` says which)
  up,             ///< can send
  error_passive,  ///< can send, but the controller sees many errors (wiring, bit rate, nobody acknowledges)
  bus_off,        ///< the controller took itself off the network; needs a cycle
  stalled,        ///< frames are handed over and not confirmed; needs a cycle
};
std::string_view to_string(InterfaceState state);

struct PortState {
  InterfaceState link = InterfaceState::removed;
  std::optional<Error> error;  ///< why it cannot send, or what is wrong though it can; none with `up`

  [[nodiscard]] bool can_send() const {
    return link == InterfaceState::up || link == InterfaceState::error_passive;
  }
  /// Nothing is sent until the link was taken down and up again: that alone empties the kernel's queue of
  /// frames that would otherwise go out when the network comes back (M26). The port does not do it: it takes
  /// privileges.
  [[nodiscard]] bool needs_cycle() const {
    return link == InterfaceState::bus_off || link == InterfaceState::stalled;
  }
};

/// The name that stands for a network in this process.
inline constexpr std::string_view simulated_interface = "sim";

/// Settings of one CAN network.
struct PortSettings {
  std::string bus;                ///< name in the YAML, for errors
  std::string interface;          ///< network interface ("can0")
  std::uint32_t bitrate = 0;      ///< bit/s; the interface's must be the same; 0: any
  std::size_t window = 4;         ///< frames handed to the kernel and not yet confirmed, at most
  std::size_t queue_limit = 256;  ///< frames that wait here, at most (stops: twice as many)
  /// The oldest unconfirmed frame may be this old without another being confirmed; longer: stalled.
  Duration stall_timeout = std::chrono::milliseconds(100);
};

/// Counters of one port since start.
struct PortCounters {
  std::uint64_t received = 0, sent = 0, not_sent = 0, unknown = 0, error_frames = 0,
                receive_overflows = 0,  ///< frames that the kernel dropped because the daemon read too slowly
      no_buffer = 0,                    ///< ENOBUFS: the kernel's queue was full
      bus_offs = 0, stalls = 0, openings = 0;
};

/// Called on the core thread, never from within a call of the port's.
struct PortHandlers {
  std::function<void(const ReceivedFrame&)> on_frame;  ///< of other nodes; own frames end in their Completion
  /// After each change; everything that the change ended has been completed before.
  std::function<void(const PortState&)> on_state;
  /// Asked after frames came: whether nobody waits for a single frame, so that the next ones may gather below
  /// for a moment, to be taken together. Empty: never.
  std::function<bool()> may_gather{};
};

/// One CAN network. Thread: core.
///
/// Each frame ends with exactly one Completion, never from within send(). At most `window` frames are
/// unconfirmed. Frames that could not be sent are never sent later: when the port stops being able to send,
/// what is queued ends as `port_down` and what is unconfirmed as `unknown`, and nothing is written until the
/// port can send again (after bus-off or a stall: until the link was cycled).
class Port {
 public:
  virtual ~Port() = default;

  /// Sets the handlers and starts opening the interface (again and again, with back-off). Once only.
  virtual void start(PortHandlers handlers) = 0;
  /// Queues `frame`, and hands it over at once if nothing is before it.
  virtual void send(const Frame& frame, const SendOptions& options, Completion completion) = 0;
  /// Ends queued motion frames whose gate was raised. Called for each stop before its frame is queued.
  virtual void purge_superseded(const AxisGate& gate) = 0;
  /// Ends everything as when the port goes down, completed before this returns, and sends nothing any more.
  /// No handler is called after it. The destructor calls nothing at all: close first. A handler may
  /// call it, but not destroy the port.
  virtual void close() = 0;
  /// Takes the link down and up, which empties its queue (M26). False: somebody with privileges has to.
  virtual bool cycle() { return false; }

  [[nodiscard]] virtual const PortState& state() const = 0;
  [[nodiscard]] virtual const PortCounters& counters() const = 0;
  [[nodiscard]] virtual const PortSettings& settings() const = 0;
};

}  // namespace axisd::can
