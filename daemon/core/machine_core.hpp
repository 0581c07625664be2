#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/canopen/canopen_bus.hpp"
#include "buses/modbus_rtu/rtu_bus.hpp"
#include "config/configuration.hpp"
#include "daemon/core/audit_trail.hpp"
#include "daemon/core/bus_recorder.hpp"
#include "daemon/core/command_log.hpp"
#include "daemon/core/event_log.hpp"
#include "daemon/core/flight_recorder.hpp"
#include "daemon/core/group_keeper.hpp"
#include "daemon/core/lease_keeper.hpp"
#include "daemon/core/link_cycler.hpp"
#include "daemon/core/machine_buses.hpp"
#include "daemon/core/machine_table.hpp"
#include "daemon/core/motion_inhibit.hpp"
#include "daemon/core/reload.hpp"
#include "daemon/core/state_gate.hpp"
#include "daemon/core/stop_hold_keeper.hpp"
#include "devices/axis/axis.hpp"
#include "devices/axis/command_book.hpp"
#include "devices/generic/device.hpp"
#include "devices/machine.hpp"
#include "devices/persistence.hpp"

namespace axisd::core {

/// What a machine is built from; tests hand in virtual time and a virtual wire.
struct MachineParts {
  Executor executor;
  Clock* clock = nullptr;
  Persistence* persistence = nullptr;  ///< may be null: nothing is kept
  CommandJournal* journal = nullptr;   ///< may be null: repeats are not known over a restart
  AuditSink* audit = nullptr;          ///< may be null: there is no audit
  std::string instance_id;
  std::function<std::unique_ptr<modbus_rtu::Line>(const modbus_rtu::LineSettings&)> make_line;
  /// May be empty where the configuration has no CAN network.
  std::function<std::unique_ptr<can::Port>(const canopen::NetworkSettings&)> make_port{};
  LinkHelper link_helper{};  ///< without: links stay as they are after bus-off and stalls (M26)
  FrameObserver observer{};  ///< told every frame (the wire log); may be empty
  store::RecordFiles* flight_records = nullptr;  ///< may be null: none are written
  std::vector<BusBudgetReport> budgets{};        ///< as computed; may be empty: none is told
  /// Simulated drives of a new configuration; may be empty.
  std::function<void(const config::Configuration&, const std::vector<ConfigurationChange>&)>
      reconfigure_simulation{};
  std::function<void()> published;
};

/// All buses, axes and other devices of one machine. Thread: core.
class MachineCore {
 public:
  MachineCore(MachineParts parts, const config::Configuration& configuration);
  ~MachineCore();
  MachineCore(const MachineCore&) = delete;

  /// Opens the buses and connects axes and devices. Moves nothing.
  void start();

  /// What there is, for every thread.
  [[nodiscard]] MachineTablePtr table() const { return table_.load(); }
  [[nodiscard]] Axis* find(std::string_view axis) const;
  [[nodiscard]] const std::vector<std::unique_ptr<Axis>>& axes() const { return axes_; }
  /// All buses, of either kind.
  [[nodiscard]] const std::vector<Bus*>& buses() const { return buses_.all; }
  [[nodiscard]] const std::vector<std::unique_ptr<canopen::CanopenBus>>& networks() const {
    return buses_.networks;
  }
  /// nullptr if there is none of that name.
  [[nodiscard]] Bus* find_bus(std::string_view bus) const { return buses_.find(bus); }
  /// The same, if it is an RS-485 line.
  [[nodiscard]] modbus_rtu::RtuBus* find_line(std::string_view bus) const { return buses_.find_line(bus); }
  /// The same, if it is a CAN network.
  [[nodiscard]] canopen::CanopenBus* find_network(std::string_view bus) const {
    return buses_.find_network(bus);
  }
  /// Nodes that are not axes, in the order of the file.
  [[nodiscard]] const std::vector<std::unique_ptr<Device>>& devices() const { return devices_; }
  [[nodiscard]] CommandBook& book() { return book_; }
  [[nodiscard]] EventLog& events() { return events_; }
  [[nodiscard]] const EventLog& events() const { return events_; }
  [[nodiscard]] const CommandLog& commands() const { return commands_; }
  [[nodiscard]] AuditTrail& audit() { return audit_; }
  [[nodiscard]] LeaseKeeper& leases() { return leases_; }
  [[nodiscard]] GroupKeeper& groups() { return groups_; }

  Result<CommandPtr> submit(const std::string& axis, const Action& action, const CommandOptions& options);
  /// The same of a stop that is held. `settled`: as of StopHoldKeeper::add(), unless it is refused.
  Result<CommandPtr> submit_held(const std::string& axis, const StopRequest& request,
                                 const CommandOptions& options, std::function<void()> settled);
  /// Ends holds of an axis, once that is durable. Errors: unknown_axis, those of StopHoldKeeper::release(),
  /// and, of everybody's, of the lease that it needs where there is one.
  void release_stop(const std::string& axis, const HoldRelease& release,
                    std::function<void(Result<StopReleased>)> done);
  /// Latches the inhibit first, then stops every axis, moving ones first (M14).
  /// `arrived`: as of CommandOptions. `latched` (may be empty) is called once: when the latch is durable, or
  /// with why it is not, or not yet after StopHoldKeeper::longest_wait.
  std::vector<Result<CommandPtr>> stop_all(const std::string& client, TimePoint arrived = {},
                                           std::function<void(std::optional<Error>)> latched = {},
                                           const CallOriginPtr& origin = {});
  /// Ends the inhibit once that is durable.
  void release_inhibit(const std::string& client, std::function<void(Result<void>)> done);
  /// Who latched the inhibit, or nullptr. Thread: any.
  [[nodiscard]] boost::shared_ptr<const std::string> inhibited_by() const { return inhibit_.by(); }
  [[nodiscard]] StateGate& state_gate() { return state_gate_; }
  [[nodiscard]] const StateGate& state_gate() const { return state_gate_; }
  /// Stops what moves, for the end of the daemon. Returns the names of these axes.
  std::vector<std::string> stop_moving_axes();
  [[nodiscard]] bool at_rest() const;
  // machine_reload.cpp
  /// Why the machine cannot become this now: all reasons, each with what to do; empty: it can.
  [[nodiscard]] std::vector<Error> check_reload(const Reload& reload) const;
  /// All of it, or, with what check_reload() says, nothing. What is the same as before is not touched: it
  /// goes on moving. From the moment of the check on, axes that change refuse everything (`reloading`) until
  /// their successors are there; stops wait for those. They come up as after a start of the daemon (M1, M20).
  void reload(Reload reload, ReloadDone done);

  [[nodiscard]] std::vector<BusStatus> bus_status() const;
  /// Of a bus, since the start.
  [[nodiscard]] StopDelays stop_delays(std::string_view bus) const { return buses_.delays_of(bus); }
  /// Why nothing new is started: the command journal or the audit cannot be written. Thread: any.
  [[nodiscard]] std::optional<Error> storage_error() const { return book_.trouble(); }
  /// Why new requests are refused at present, if they may be old ones. Thread: any.
  [[nodiscard]] std::optional<Error> doubt() const { return book_.doubt(); }
  /// What sees the frames of a bus. nullptr if there is none of that name.
  [[nodiscard]] const BusRecorder* find_recorder(std::string_view bus) const;
  [[nodiscard]] FlightRecorder& flight_recorder() { return flight_recorder_; }
  /// Those of the parts, with what the axes have seen.
  [[nodiscard]] std::vector<BusBudgetReport> budgets() const;
  /// Runs a sequence that uses what this owns; closed() waits for its end.
  void launch(Task<> sequence, const char* name);
  /// Ends all sequences; then closed() comes true and the machine can be destroyed. Moves nothing.
  void close();
  [[nodiscard]] bool closed() const;
  [[nodiscard]] bool closing() const { return life_ == Life::closing; }
  /// Every bus is open, or it is known why not.
  [[nodiscard]] bool buses_reported() const;

 private:
  enum class Life : std::uint8_t {
    running,
    ending,   ///< the daemon ends: no reload is carried out any more
    closing,  ///< nothing new is begun
  };

  // machine_build.cpp: what the configuration names
  /// `memory`: of its recorder, bytes.
  void add_line(const modbus_rtu::LineSettings& line, std::size_t memory);
  void add_network(const canopen::NetworkSettings& network, std::size_t memory);
  /// `face`: of the axis that it takes the place of; nullptr: there was none.
  [[nodiscard]] std::unique_ptr<Axis> make_axis(const AxisSettings& settings, AxisFacePtr face);
  [[nodiscard]] std::unique_ptr<Device> make_device(const DeviceSettings& settings);
  void publish_table();

  // machine_reload.cpp
  void check_parts(const Reload& reload, const ConfigurationChange& change,
                   std::vector<Error>& refusals) const;
  void check_sync_for_reload(const ConfigurationChange& change, std::vector<Error>& refusals) const;
  void check_groups_for_reload(const Reload& reload, const ConfigurationChange& change,
                               std::vector<Error>& refusals) const;
  void check_lease_for_reload(const Reload& reload, const ConfigurationChange& change,
                              std::vector<Error>& refusals) const;
  [[nodiscard]] bool has_made_room() const;
  [[nodiscard]] std::string unstopped(const Reload& reload) const;
  Task<> run_reload(Reload reload, ReloadDone done);
  Task<> stop_leaving(std::string name);
  Task<> send_stop(Axis& axis, StopKind kind);
  void carry_out(Reload& reload);
  void clear_away();
  [[nodiscard]] std::vector<Axis*> renew_axes(const Reload& reload);
  [[nodiscard]] std::vector<Device*> renew_devices(const Reload& reload);
  void tell_reloaded(const Reload& reload);
  CommandPtr hold_stop(std::vector<HeldStop>& stops, const std::string& axis, const StopRequest& request,
                       const CommandOptions& options);

  Result<CommandPtr> execute(Axis& axis, const Action& action, const CommandOptions& options);
  Result<CommandPtr> no_axis(const std::string& axis, const Action& action, const CommandOptions& options);
  void expect_stops();
  Task<> watch(canopen::CanopenBus& network);
  Task<> watch_port(Bus& bus);
  BusRecorder& add_recorder(const std::string& bus, int bit_rate, std::size_t memory);
  void on_event(const std::string& axis, EventContent content);
  void note_fault(const Axis& axis, const EventContent& content);
  void tell_inhibit(InhibitChange change);

  MachineParts parts_;
  CommandBook book_;
  AuditTrail audit_;
  EventLog events_;
  CommandLog commands_;
  std::vector<std::unique_ptr<BusRecorder>> recorders_;  ///< one per bus; before the buses, which tell them
  FlightRecorder flight_recorder_;
  LeaseKeeper leases_;
  StopHoldKeeper holds_;
  StateGate state_gate_;
  MotionInhibit inhibit_;
  MachineBuses buses_;  ///< before the axes, which use them
  std::vector<std::unique_ptr<Axis>> axes_;
  std::vector<std::unique_ptr<Device>> devices_;
  GroupKeeper groups_;  ///< after the axes, which its moves are of
  int sequences_ = 0;   ///< launched ones that still run
  Life life_ = Life::running;
  Exchange exchange_;
  std::map<std::string, Axis*, std::less<>> by_name_;
  boost::atomic_shared_ptr<const MachineTable> table_;
};

}  // namespace axisd::core
