// Several simulated nodes on one RS-485 line, in the time that it is given: no thread, no socket, no clock.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "buses/clock.hpp"
#include "devices/simulation/fault_plan.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::simulation {

struct RtuNetworkSettings {
  int baud = 115200;
  int bits_per_character = 10;  ///< 8N1: 10, with parity or a second stop bit 11
  /// From the last byte of a request to the first of its reply. A node cannot be faster than the silence by
  /// which it recognises the end of the frame; the larger of the two counts. The manuals give no figure; 2 ms
  /// is a little more than that silence above 19200 baud.
  Duration turnaround = std::chrono::milliseconds(2);
};

/// What comes back over the wire after one request.
struct ReplyPlan {
  TimePoint begin;                  ///< first bit of the first byte
  TimePoint end;                    ///< last bit of the last byte
  std::vector<std::uint8_t> bytes;  ///< all bytes, an echo or a foreign frame before the reply included
  std::vector<TimePoint> arrivals;  ///< end of each byte
  std::size_t repeated = 0;         ///< bytes at the end that are the reply once more
};

/// A frame seen on the wire. `received`: from the master, also when a fault or a cut cable keeps it from the
/// drives. `begin`: its first bit. Called by whoever lets time pass; must not block.
using FrameObserver =
    std::function<void(TimePoint begin, bool received, std::span<const std::uint8_t> frame)>;

/// Dispatches frames to nodes, applies faults and computes when the reply's bytes are on the wire.
/// Two uses: on_request() for whoever has whole frames (a virtual wire), on_bytes() + advance() +
/// take_reply() for whoever has a byte stream (a pty). Times never go backwards. Thread: that of its owner.
class RtuNetwork {
 public:
  explicit RtuNetwork(RtuNetworkSettings settings = {});

  /// What the master has set its side to, from now on: times follow it, and nodes with other settings hear
  /// garbage. Before the first call every node hears the line.
  void set_serial(const Serial& serial);
  [[nodiscard]] const std::optional<Serial>& serial() const { return serial_; }

  SimulatedRtuNode& add(std::unique_ptr<SimulatedRtuNode> node);
  /// Takes whoever has this address off the line; nothing if nobody has.
  void remove(std::uint8_t address);
  [[nodiscard]] std::span<const std::unique_ptr<SimulatedRtuNode>> nodes() const { return nodes_; }
  /// nullptr if nobody has this address now.
  [[nodiscard]] SimulatedRtuNode* node(std::uint8_t address) const;
  [[nodiscard]] FaultPlan& faults() { return faults_; }

  void set_observer(FrameObserver observer) { observer_ = std::move(observer); }

  /// A whole frame whose last byte ended at `request_end`. Nothing: nobody answers.
  std::optional<ReplyPlan> on_request(std::span<const std::uint8_t> frame, TimePoint request_end);

  /// Bytes that begin on the wire at `begin`, or when the bytes before them have passed. A silence of 3.5
  /// characters ends a frame.
  void on_bytes(std::span<const std::uint8_t> bytes, TimePoint begin);
  /// Lets time pass: nodes move, frames end, supplies come back.
  void advance(TimePoint now);
  /// When advance() has something to do next; TimePoint::max() if nothing waits.
  [[nodiscard]] TimePoint next_event() const;
  /// Replies to frames that came through on_bytes(), oldest first.
  std::optional<ReplyPlan> take_reply();
  /// For owners that took a reply from on_request() and want it in the same row.
  void add_reply(ReplyPlan reply) { replies_.push_back(std::move(reply)); }

  /// Cuts the cable (nothing passes either way while the drives go on) or joins it again.
  void set_connected(bool connected) { connected_ = connected; }
  [[nodiscard]] bool connected() const { return connected_; }
  /// True once after a `hang_up` fault struck: the owner pulls the adapter out.
  bool take_hang_up() { return std::exchange(hang_up_, false); }

  [[nodiscard]] TimePoint now() const { return now_; }
  [[nodiscard]] Duration character_time() const;
  /// 3.5 characters, 1.75 ms above 19200 baud (Modbus over serial line 2.5.1.1).
  [[nodiscard]] Duration silence() const;
  [[nodiscard]] Duration turnaround() const { return std::max(settings_.turnaround, silence()); }

 private:
  struct Return {
    TimePoint when;
    SimulatedRtuNode* node;
  };
  std::optional<std::vector<std::uint8_t>> dispatch(std::span<const std::uint8_t> frame);
  std::optional<ReplyPlan> plan(std::span<const std::uint8_t> request, TimePoint request_end,
                                const std::vector<Fault>& faults,
                                std::optional<std::vector<std::uint8_t>> reply);
  [[nodiscard]] bool hears(const SimulatedRtuNode& node) const;
  void reboot(std::span<const std::uint8_t> request, Duration off_time);
  void pass_time(TimePoint now);

  RtuNetworkSettings settings_;
  std::optional<Serial> serial_;
  std::vector<std::unique_ptr<SimulatedRtuNode>> nodes_;
  FaultPlan faults_;
  std::vector<Return> returns_;  ///< supplies that come back
  std::vector<std::uint8_t> partial_;
  TimePoint partial_end_{};
  std::deque<ReplyPlan> replies_;
  FrameObserver observer_;
  TimePoint now_{};
  bool connected_ = true;
  bool hang_up_ = false;
};

}  // namespace axisd::simulation
