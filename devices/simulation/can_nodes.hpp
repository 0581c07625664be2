// Several simulated nodes on one CAN network, in the time of a clock.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "buses/can/network.hpp"
#include "buses/can/port.hpp"
#include "buses/clock.hpp"
#include "devices/simulation/can_upload_trap.hpp"
#include "devices/simulation/fault_plan.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::simulation {

/// Hands frames to nodes and theirs to the wire, applies faults, and keeps a timer on the next thing that any
/// node does. What one node sends reaches the others at once. Thread: the clock's.
class CanNodes {
 public:
  /// Puts a frame on the wire; must not call back into CanNodes.
  using Send = std::function<void(const can::Frame&)>;
  /// A frame that passed the wire. `received`: by the nodes, also when a fault or a cut cable keeps it from
  /// them.
  using Observer = std::function<void(TimePoint at, bool received, const can::Frame& frame)>;

  /// `clock` must outlive it.
  CanNodes(Clock& clock, Send send) : clock_(&clock), send_(std::move(send)), now_(clock.now()) {}
  CanNodes(const CanNodes&) = delete;

  /// What the wire runs at, bit/s: nodes set to something else hear and send nothing. Before the first call
  /// every node hears it; with the first call all join it, and so do nodes added later.
  void set_bitrate(std::uint32_t bitrate);

  SimulatedCanNode& add(std::unique_ptr<SimulatedCanNode> node);
  /// Takes whoever has this node-ID off the network; nothing if nobody has.
  void remove(std::uint8_t address);
  [[nodiscard]] std::span<const std::unique_ptr<SimulatedCanNode>> nodes() const { return nodes_; }
  /// nullptr if nobody has this node-ID now.
  [[nodiscard]] SimulatedCanNode* node(std::uint8_t address) const;

  /// A frame from the wire that ended at `at`.
  void on_frame(const can::Frame& frame, TimePoint at);
  /// Lets time pass until now, sends what is to be sent, and sets the timer. To be called after anything was
  /// done to a node directly.
  void advance() { pass_time(clock_->now()); }
  /// When the nodes do what they do now: of a late host the time at which it was due, not the clock's.
  [[nodiscard]] TimePoint now() const { return now_; }

  /// Strikes at once, or waits for its frame.
  void add_fault(const Fault& fault);
  /// Ends silences and floods, too.
  void clear_faults();
  [[nodiscard]] std::size_t pending_faults() const { return faults_.pending(); }

  /// Cuts the cable (nothing passes either way while the drives go on) or joins it again.
  void set_connected(bool connected) { connected_ = connected; }
  void set_observer(Observer observer) { observer_ = std::move(observer); }

 private:
  /// What faults do to one node.
  struct Trouble {
    TimePoint silent_until{};
    TimePoint returns = TimePoint::max();  ///< its supply
    TimePoint flood_until{}, flood_next = TimePoint::max();
    Fault flood{};
    int lost_replies = 0;
    std::vector<Duration> late_replies{};
    std::optional<UploadTrap> trap{};
  };
  void pass_time(TimePoint now);
  void run_until(TimePoint now);
  [[nodiscard]] TimePoint next_event() const;
  void set_timer();
  [[nodiscard]] bool hears(const SimulatedCanNode& node) const;
  [[nodiscard]] bool silent(const SimulatedCanNode& node) const;
  Trouble& trouble(const SimulatedCanNode& node) { return troubles_[&node]; }
  void deliver(SimulatedCanNode& node, const can::Frame& frame);
  void hand_over(SimulatedCanNode& node, const can::Frame& frame);
  void strike(SimulatedCanNode& node, const Fault& fault);
  void reboot(SimulatedCanNode& node, Duration off_time);
  void collect();
  void from_node(SimulatedCanNode& node, const can::Frame& frame);
  void emit(const SimulatedCanNode& node, const can::Frame& frame);
  void send_later(const SimulatedCanNode& node, TimePoint when, const can::Frame& frame);
  void flood(const SimulatedCanNode& node, Trouble& trouble);

  Clock* clock_;
  Send send_;
  Observer observer_;
  std::vector<std::unique_ptr<SimulatedCanNode>> nodes_;
  std::map<const SimulatedCanNode*, Trouble> troubles_;
  FaultPlan faults_;
  std::multimap<TimePoint, std::pair<const SimulatedCanNode*, can::Frame>> late_;  ///< replies held back
  std::optional<std::uint32_t> bitrate_;
  TimePoint now_;
  bool connected_ = true;
  Clock::Timer timer_;
};

/// CanNodes as participants of a network in this process, which outlives them: the node with the lowest
/// identifier sends first. Thread: the clock's.
class NetworkNodes {
 public:
  NetworkNodes(Clock& clock, can::Network& network);
  ~NetworkNodes() { network_->leave(id_); }
  NetworkNodes(const NetworkNodes&) = delete;

  [[nodiscard]] CanNodes& nodes() { return nodes_; }

 private:
  void transmit();

  can::Network* network_;
  CanNodes nodes_;
  can::Network::Id id_;
  std::multimap<std::uint32_t, can::Frame> waiting_;  ///< by identifier; frames of one in their order
  bool on_wire_ = false;
};

}  // namespace axisd::simulation
