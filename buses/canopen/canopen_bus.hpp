// One CANopen network as axes and drives use it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "buses/bus.hpp"
#include "buses/canopen/common_start.hpp"
#include "buses/canopen/master.hpp"
#include "buses/canopen/settings.hpp"

namespace axisd::canopen {

/// What a drive wants to hear of its node. Called on the core thread; must not wait.
struct NodeHandlers {
  std::function<void(const NodeEvent&)> on_event;  ///< boot-up, heartbeat lost and back, state changed
  std::function<void(const Emergency&)> on_emergency;
  /// Another master tells it something; `what` as in ForeignCommand.
  std::function<void(const std::string& what)> on_foreign_command{};
};

/// The master of one network, with what its nodes share: the port's state, and SYNC. Thread: core.
///
/// SYNC (M24): it runs only while the port can send and no attached node may hold a set-point that the next
/// SYNC would start. So it starts when each attached node was either settled by its drive (nothing is armed)
/// or found absent; it stops with the port, and every node has to be settled again. A node that was armed
/// for a common start is settled by nothing but its drive, or a boot-up message.
class CanopenBus final : public Bus {
 public:
  CanopenBus(Executor executor, Clock& clock, NetworkSettings settings, std::unique_ptr<can::Port> port);
  ~CanopenBus() override;
  CanopenBus(const CanopenBus&) = delete;

  /// Opens the port.
  void start();

  /// Registers the drive of a node, which may hold something for the next SYNC: none goes out until it is
  /// settled. Errors: not a node-ID, attached twice.
  Result<void> attach(std::uint8_t node, NodeHandlers handlers);
  /// The drive is going away.
  void detach(std::uint8_t node);
  /// From now on `node` is expected to be heard at least every `timeout` (0: not watched).
  void watch_heartbeat(std::uint8_t node, Duration timeout);

  enum class Readiness : std::uint8_t {
    unknown,  ///< it may hold an armed set-point: no SYNC is started
    absent,   ///< it does not answer
    settled,  ///< its drive knows that nothing waits for a SYNC
  };
  /// `unknown` stops SYNC.
  void set_readiness(std::uint8_t node, Readiness readiness);
  /// Called when a SYNC is on the network, with its time, in the order of subscription; dropping the token
  /// ends it.
  [[nodiscard]] std::shared_ptr<void> on_sync(std::function<void(TimePoint)> handler);
  /// Its cycles go out.
  [[nodiscard]] bool sync_running() const { return master_.sync().running() && !master_.sync().held(); }

  /// Why no cycles have gone out for some seconds though the network is up, and what to do; nothing: they do,
  /// or there are to be none. Logged as well.
  [[nodiscard]] const std::optional<Error>& sync_trouble() const { return sync_trouble_; }

  /// Starts nodes with one SYNC: all of them, or none. The time of the SYNC: its end on the wire. Cycles of
  /// SYNC are held meanwhile, and go on afterwards at the times of before, if there are any. Errors with an
  /// outcome other than `unknown`: no SYNC was sent, and none is before each member that was armed is
  /// settled. `unknown`: members may have started, all of them or some. The SYNC comes at `not_before` or as
  /// soon after as possible; they are armed shortly before.
  Task<Result<TimePoint>> start_together(std::vector<SyncStart> members, TimePoint not_before = {}) {
    return common_start(*this, std::move(members), not_before);
  }
  /// Until the token is dropped no cycle of SYNC goes out, and nobody else holds them. Waits for whoever
  /// does, and for what is on its way.
  Task<std::shared_ptr<void>> hold_sync();
  /// Why no SYNC may be sent for a common start; nothing: it may.
  [[nodiscard]] std::optional<Error> objection_to_sync() const;
  /// One SYNC now. Precondition: held. Errors: objection_to_sync(), and as the port's.
  Task<Result<TimePoint>> send_sync(can::SendOptions options);
  /// Sends a PDO that waits in `node` for the next SYNC. Errors: as the port's.
  Task<Result<can::SendResult>> send_waiting(std::uint8_t node, std::uint32_t cob_id, Bytes bytes,
                                             can::SendOptions options);
  /// Something that send_waiting() sent may wait there still.
  [[nodiscard]] bool waits(std::uint8_t node) const;
  /// What waits in `node` for the next SYNC starts something: until it is settled no cycle goes out.
  void set_armed(std::uint8_t node, bool armed);
  [[nodiscard]] bool armed(std::uint8_t node) const;

  [[nodiscard]] const Executor& executor() const { return executor_; }
  [[nodiscard]] Clock& clock() const { return *clock_; }
  [[nodiscard]] Master& master() { return master_; }
  [[nodiscard]] const Master& master() const { return master_; }
  [[nodiscard]] const NetworkSettings& settings() const { return settings_; }
  /// Of the port, more precise than port(): bus-off and stall need a cycle of the link (M26).
  [[nodiscard]] const can::PortState& link() const { return master_.port().state(); }
  /// Takes the link of a simulated network down and up. False: it is a real one, which takes privileges.
  bool cycle_link() { return simulated() && master_.cycle_link(); }
  /// How often the port ceased to be able to send: an outage may be over before somebody looks at the port.
  [[nodiscard]] std::uint64_t losses() const { return losses_; }
  /// Why it did so the last time.
  [[nodiscard]] const std::optional<Error>& last_loss() const { return last_loss_; }

  [[nodiscard]] const std::string& name() const override { return settings_.name; }
  [[nodiscard]] bool simulated() const override { return settings_.simulated(); }
  [[nodiscard]] const PortStatus& port() const override { return port_; }
  [[nodiscard]] Signal& port_changed() override { return port_changed_; }
  void purge_superseded(std::uint8_t node, const AxisGate& gate) override {
    master_.purge_superseded(node, gate);
  }
  /// Each node has a queue of its own, in which nothing waits behind another's requests.
  void hasten(std::uint8_t /*node*/, TransactionClass /*to*/) override {}
  void about_to_energise() override {}
  void close() override;
  [[nodiscard]] bool idle() const override { return closed_; }
  [[nodiscard]] TimePoint last_progress() const override { return TimePoint::max(); }

 private:
  struct Node {
    NodeHandlers handlers;
    Readiness readiness = Readiness::unknown;
    bool armed = false;  ///< what waits there starts something
    bool waits = false;
    int on_its_way = 0;  ///< of what will wait there
    [[nodiscard]] bool may_hear_sync() const { return !armed && readiness != Readiness::unknown; }
  };
  void on_port(const can::PortState& state);
  void on_foreign_command(const ForeignCommand& command);
  void on_node(const NodeEvent& event);
  void consider_sync();
  /// The node for whose sake no SYNC is started; nullptr: none.
  [[nodiscard]] const std::pair<const std::uint8_t, Node>* sync_blocker() const;
  void watch_sync(bool blocked);
  void tell_sync_trouble();
  void release_sync();
  void tell_sync(TimePoint at);

  Executor executor_;
  Clock* clock_;
  NetworkSettings settings_;
  PortStatus port_;
  Signal port_changed_;
  Master master_;
  std::map<std::uint8_t, Node> nodes_;
  std::map<int, std::weak_ptr<std::function<void(TimePoint)>>> sync_handlers_;
  int last_sync_handler_ = 0;
  std::weak_ptr<void> holder_;  ///< of SYNC
  Signal sync_released_, sync_idle_;
  std::optional<Clock::Timer> sync_overdue_;  ///< while SYNC should run and does not
  std::optional<Error> sync_trouble_;
  std::shared_ptr<int> alive_ = std::make_shared<int>();
  std::uint64_t losses_ = 0;
  std::optional<Error> last_loss_;
  bool closed_ = false;
};

}  // namespace axisd::canopen
