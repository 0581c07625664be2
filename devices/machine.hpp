// What the API sees of a machine. Implemented by the daemon's composition; every call is safe from any
// thread.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/canopen/master.hpp"
#include "buses/modbus_rtu/rtu_bus.hpp"
#include "devices/axis/command.hpp"
#include "devices/axis/obstacles.hpp"
#include "devices/axis/snapshot.hpp"
#include "devices/axis/stop_holds.hpp"
#include "devices/budget.hpp"
#include "devices/bus_access.hpp"
#include "devices/bus_kind.hpp"
#include "devices/bus_watch.hpp"
#include "devices/drive_access.hpp"
#include "devices/event.hpp"
#include "devices/group/group.hpp"
#include "devices/lease/lease.hpp"

namespace axisd {

/// What is known of a CAN network beside whether it is open. Counters since start.
struct NetworkStatus {
  can::InterfaceState link = can::InterfaceState::removed;
  can::PortCounters frames{};
  canopen::SdoCounters sdo{};
  Duration sync_period{};  ///< 0: none is sent
  bool sync_running = false;
  canopen::SyncCounters sync{};
  std::uint64_t emergencies = 0;
  canopen::MasterCounters others{};
  std::vector<std::uint8_t> foreign_nodes{};  ///< heard, but not configured
  std::optional<Error> link_helper_error{};   ///< why the link would not be cycled when it has to be (M26)
};

struct BusStatus {
  std::string name;
  BusKind kind = BusKind::modbus_rtu;
  std::string port;  ///< serial device or network interface
  int baud = 0;      ///< or bit rate
  bool open = false;
  bool simulated = false;
  std::optional<Error> error{};
  modbus_rtu::BusCounters counters{};      ///< of an RS-485 line
  std::optional<NetworkStatus> network{};  ///< of a CAN network
};

struct MachineInfo {
  std::string machine;  ///< name from the YAML
  std::string version;
  std::string instance_id;  ///< new with every start
  bool inhibited = false;   ///< StopAll is latched
  std::string inhibited_by;
  /// Why motion waits until the state is accepted; empty: it does not.
  std::string state_unaccepted;
  std::optional<Error> storage_error{};  ///< nothing new is started for it, or for a doubt about what was
};

/// What became of a StopAll.
struct AllStopped {
  std::vector<Result<Command>> stops{};  ///< of each axis
  std::optional<Error>
      not_durable{};  ///< the latch would not outlive a restart of the daemon; nothing: it does
};

/// What a machine remembers over restarts, and whether that is certain.
struct KeptStateReport {
  KeptStateSeen seen{};                   ///< at the start of the daemon
  std::vector<Conviction> convictions{};  ///< motion waits until they are accepted; none: it does not
  std::uint64_t start_count = 0;          ///< of the daemon
};

/// What became of the release of a held stop.
struct StopReleased {
  std::optional<Command> stop{};  ///< the newest one; nothing: there was none in this run of the daemon
  std::vector<StopHold> holds{};  ///< who still holds the axis
};

/// Thread: any. Callbacks arrive on the core thread and must only hand over.
class Machine {
 public:
  using CommandCallback = std::function<void(Result<Command>)>;
  virtual ~Machine() = default;

  [[nodiscard]] virtual std::vector<std::string> axis_names() const = 0;
  /// The latest state, without waiting for the core. nullptr: unknown axis.
  [[nodiscard]] virtual AxisSnapshotPtr snapshot(std::string_view axis) const = 0;
  [[nodiscard]] virtual MachineInfo info() const = 0;

  /// Validates and starts a command; calls back exactly once: with an error if it was not accepted, else when
  /// it reached `until` or ended, and, of a stop with hold, when the hold is durable or it is known that it
  /// is not. Ending the call early never changes the command. Stops take their own lane.
  virtual void submit(std::string axis, Action action, CommandOptions options, WaitUntil until,
                      CommandCallback callback) = 0;

  /// Everything that stands in the way of `action` now, in the order in which submit() would refuse it;
  /// without one, of motion in general. Touches nothing. Errors: unknown_axis.
  virtual void explain(std::string axis, std::optional<Action> action, CommandOptions options,
                       std::function<void(Result<std::vector<Obstacle>>)> callback) = 0;

  /// Ends holds of an axis (MC_Stop with Execute going false). Errors: unknown_axis, invalid_argument (there
  /// is none that is meant), stopping (held anew meanwhile), storage, and, of everybody's, those of leases.
  virtual void release_stop(std::string axis, HoldRelease release,
                            std::function<void(Result<StopReleased>)> callback) = 0;
  /// Stops all axes and latches the inhibit (M14). Calls back with the stop command of each axis, once it is
  /// known whether the latch is durable, or that takes longer than a second. The lease is not looked at.
  virtual void stop_all(Requester requester, WaitUntil until, std::function<void(AllStopped)> callback) = 0;
  virtual void release_inhibit(std::string client, std::function<void(Result<void>)> callback) = 0;
  /// How many axes this identity, and whom it speaks for, have asked to stop that the core has not begun to
  /// stop yet, each as often as it was asked for. None of these is ever dropped: whoever takes stops in can
  /// take in less of such a client.
  [[nodiscard]] virtual std::size_t stops_waiting(const std::string& identity) const = 0;

  virtual void kept_state(std::function<void(KeptStateReport)> callback) = 0;
  /// A person has looked at the convictions: motion waits for them no longer, once that is durable. Calls
  /// back with those that were accepted; none: there was nothing. Errors: storage (they stand).
  virtual void accept_state(std::string client,
                            std::function<void(Result<std::vector<Conviction>>)> callback) = 0;

  /// The newest commands of this run of the daemon, newest first, at most `most`; of one axis unless that is
  /// empty. Of a client that gives very many the older ones are forgotten before those of others.
  virtual void list_commands(std::string axis, std::size_t most,
                             std::function<void(std::vector<Command>)> callback) = 0;
  /// A known command; calls back at once. Errors: unknown_command.
  virtual void get_command(std::string id, CommandCallback callback) = 0;
  /// Calls back at each change of the command until it has ended (the last call) or the returned token is
  /// dropped.
  virtual std::shared_ptr<void> watch_command(std::string id, CommandCallback callback) = 0;
  /// Halts the axis of the command for this client, in its turn with stops. Errors: unknown_command.
  virtual void cancel_command(std::string id, std::string client, CommandCallback callback) = 0;

  virtual void buses(std::function<void(std::vector<BusStatus>)> callback) = 0;
  /// What each bus can promise, with what was seen up to now.
  virtual void budgets(std::function<void(std::vector<BusBudgetReport>)> callback) = 0;

  [[nodiscard]] virtual DriveAccess& drive_access() = 0;
  [[nodiscard]] virtual BusAccess& bus_access() = 0;
  [[nodiscard]] virtual BusWatch& bus_watch() = 0;
  [[nodiscard]] virtual LeaseAccess& lease_access() = 0;
  [[nodiscard]] virtual GroupAccess& group_access() = 0;
  [[nodiscard]] virtual EventSource& events() = 0;

  /// Called on the core thread whenever any snapshot was published; set once before serving.
  virtual void on_published(std::function<void()> notify) = 0;
  [[nodiscard]] virtual WallTime wall(TimePoint t) const = 0;
  [[nodiscard]] virtual TimePoint now() const = 0;
};

}  // namespace axisd
