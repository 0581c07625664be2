// A CANopen master on one network: hands each frame to whoever it concerns.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "buses/can/port.hpp"
#include "buses/canopen/emcy.hpp"
#include "buses/canopen/nmt.hpp"
#include "buses/canopen/remote_node.hpp"
#include "buses/canopen/sync.hpp"

namespace axisd::canopen {

/// Another master told a node what may start or stop it: by NMT, by a PDO, or by SDO in 6040h or 60FFh.
struct ForeignCommand {
  std::uint8_t node = 0;  ///< of NMT also 0, all nodes
  std::string what;       ///< "sends NMT 'start'", "writes 6040h:00 by SDO", "sends RPDO 1"
};
/// Nothing: it starts and stops nothing. Precondition: the frame is nobody's of this program. Pure.
std::optional<ForeignCommand> parse_foreign_command(const can::Frame& frame);

/// Told on the core thread. None may destroy the master.
struct MasterHandlers {
  std::function<void(const NodeEvent&)> on_node;
  std::function<void(const Emergency&)> on_emergency;
  std::function<void(const can::PortState&)> on_port;
  std::function<void(const ForeignCommand&)> on_foreign_command{};
};

/// Frames that concern no configured node, and what was wrong with others; since start.
struct MasterCounters {
  std::uint64_t unknown_cob = 0;    ///< no service of ours, and no PDO that somebody subscribed to
  std::uint64_t foreign_node = 0;   ///< of a node that is not configured, or of another master
  std::uint64_t malformed = 0;      ///< of a configured node, but not as CiA 301 has it
  std::uint64_t foreign_syncs = 0;  ///< SYNC of another producer; also an EMCY with its identifier
};

/// What came from or went to one node beside SDO and EMCY; since start.
struct NodeTraffic {
  std::uint64_t tpdos = 0;  ///< received, by the identifiers of the predefined set
  std::uint64_t rpdos = 0;  ///< sent, likewise
  std::uint64_t heartbeats_lost = 0, boots = 0;
  /// SDO downloads and RPDOs of another master that were begun.
  std::uint64_t foreign_writes = 0;
};

/// Thread: core. Adopts nodes as they are: starting it sends nothing (M25).
class Master {
 public:
  using PdoHandler = std::function<void(const can::ReceivedFrame&)>;

  Master(Executor executor, Clock& clock, std::unique_ptr<can::Port> port, SdoSettings sdo = {});
  ~Master();
  Master(const Master&) = delete;
  Master& operator=(const Master&) = delete;

  /// Opens the port. Once only.
  void start(MasterHandlers handlers);
  /// Ends everything that is under way; no handler is called after it. Call it before destroying, and let the
  /// core run what it ended.
  void close();

  /// Listens to `node`: boot-up, heartbeat (0: its absence is no event), EMCY. Twice: a new timeout.
  Result<void> add_node(std::uint8_t node, Duration heartbeat_timeout = {});

  /// The opposite.
  void remove_node(std::uint8_t node);

  /// Sends an NMT command to one node, and waits until it is on the network. That the node followed is seen
  /// in its heartbeat. A reset makes the drive forget its position: only when asked for explicitly (M25).
  Task<Result<void>> command(std::uint8_t node, NmtCommand command,
                             TransactionClass transaction_class = TransactionClass::parameters);

  /// Sends a PDO, and waits until it is on the network; no node confirms it. Precondition of motion: the
  /// guard of its axis. Errors: as the port's.
  Task<Result<can::SendResult>> send_pdo(std::uint32_t cob_id, Bytes bytes, can::SendOptions options);
  /// Calls `handler` for each PDO with this identifier; an empty one ends that. misconfigured: the identifier
  /// belongs to another service, or somebody has it already.
  Result<void> subscribe_pdo(std::uint32_t cob_id, PdoHandler handler);

  /// For each stop, before its frame is queued: nothing that its axis's gate forbids waits any longer.
  void purge_superseded(std::uint8_t node, const AxisGate& gate);

  [[nodiscard]] RemoteNode node(std::uint8_t id) { return {sdo_, id}; }
  [[nodiscard]] SdoClient& sdo() { return sdo_; }
  [[nodiscard]] const SdoClient& sdo() const { return sdo_; }
  /// Stops by itself when the link is lost, and stays so (M24).
  [[nodiscard]] SyncProducer& sync() { return sync_; }
  [[nodiscard]] const SyncProducer& sync() const { return sync_; }
  /// When another producer's SYNC came last.
  [[nodiscard]] std::optional<TimePoint> foreign_sync_at() const { return foreign_sync_at_; }
  [[nodiscard]] const NmtMonitor& nmt() const { return nmt_; }
  [[nodiscard]] const EmergencyHistory& emergencies() const { return emergencies_; }
  [[nodiscard]] const can::Port& port() const { return *port_; }
  /// As Port::cycle().
  bool cycle_link() { return port_->cycle(); }
  [[nodiscard]] const MasterCounters& counters() const { return counters_; }
  [[nodiscard]] const NodeTraffic& traffic(std::uint8_t node) const { return traffic_.at(node); }
  /// Nodes that were added.
  [[nodiscard]] const std::set<std::uint8_t>& nodes() const { return nodes_; }
  /// Nodes that are not configured but heard.
  [[nodiscard]] const std::set<std::uint8_t>& foreign_nodes() const { return foreign_nodes_; }

 private:
  void on_frame(const can::ReceivedFrame& received);
  void on_service(std::uint8_t node, std::uint32_t id, const can::ReceivedFrame& received);
  void on_heartbeat(std::uint8_t node, const can::ReceivedFrame& received);
  void on_emergency(std::uint8_t node, const can::ReceivedFrame& received);
  void on_node_event(const NodeEvent& event);
  void on_port_state(const can::PortState& state);
  Task<can::SendResult> sent(can::Frame frame, can::SendOptions options);

  Executor executor_;
  Clock* clock_;
  std::unique_ptr<can::Port> port_;
  MasterHandlers handlers_;
  SdoClient sdo_;
  NmtMonitor nmt_;
  SyncProducer sync_;
  EmergencyHistory emergencies_;
  std::set<std::uint8_t> nodes_, foreign_nodes_;
  std::map<std::uint32_t, PdoHandler> pdos_;
  MasterCounters counters_;
  std::array<NodeTraffic, highest_node + 1> traffic_{};  ///< by node-ID
  std::optional<TimePoint> foreign_sync_at_;
};

}  // namespace axisd::canopen
