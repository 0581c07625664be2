// The way to the drive: connecting, verifying, and what follows when it is gone or was restarted.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "buses/task.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/link_machine.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/persistence.hpp"

namespace axisd {

class DriftCheck;
class DriveWork;
class EarlierCommands;
class Execution;
class Publisher;
class Readings;
class SavedPosition;
class Sequences;
class StateReader;
class Stopper;

/// Owns the link. Connects now, and whenever the drive was lost; moves and enables nothing (M1). Thread:
/// core.
class DriveConnection {
 public:
  DriveConnection(const AxisContext& context, Sequences& sequences, Shaft& shaft, PowerMachine& power,
                  Stopper& stopper, Execution& execution, StateReader& reader, Readings& readings,
                  DriftCheck& drift, const DriveWork& work, EarlierCommands& earlier, SavedPosition& saved,
                  Publisher& publisher)
      : context_(context),
        sequences_(sequences),
        shaft_(shaft),
        power_(power),
        stopper_(stopper),
        execution_(execution),
        reader_(reader),
        readings_(readings),
        drift_(drift),
        work_(work),
        earlier_(earlier),
        saved_(saved),
        publisher_(publisher) {}
  DriveConnection(const DriveConnection&) = delete;

  /// Connects and polls until the axis ends.
  Task<> run();
  /// The drive does not answer any more: what was executed ends as Unknown, and a stop is owed (M4).
  void go_offline(const Error& cause);
  /// The drive was restarted: what was executed ends, and it is configured anew (M7).
  void on_reboot(const Error& cause);
  /// The bus could not send for a while, however short, or a stop was not acknowledged: what the axis was
  /// doing ends, and a drive that may move gets a stop first (M4, M26).
  void bus_lost(Error cause);
  /// The drive's memory is no longer what configure() made it: applied again. `position_lost`: the counter or
  /// its meaning, too.
  void reconfigure(const std::string& why, bool position_lost);

  [[nodiscard]] LinkMachine& link() { return link_; }
  [[nodiscard]] const LinkMachine& link() const { return link_; }
  [[nodiscard]] const std::optional<DriveIdentity>& identity() const { return identity_; }

 private:
  Task<> connect();
  /// `again`: the attempt before was in vain.
  Task<Result<void>> try_connect(TransactionClass contact, bool again);
  Task<Result<void>> settle_found_motion();
  Task<Result<void>> stop_found_motion();
  [[nodiscard]] bool may_have_been_stopped_abruptly() const;
  [[nodiscard]] std::vector<std::int64_t> unseen_ends() const;
  [[nodiscard]] bool found_by_terminal() const;
  Task<Result<void>> prove_or_configure();
  [[nodiscard]] std::optional<OffsetRecord> restorable_position();
  void void_saved_position();
  void own_canary();
  Task<Result<void>> configure(std::optional<OffsetRecord> restorable);
  Task<> wait_for_port();

  const AxisContext& context_;
  Sequences& sequences_;
  Shaft& shaft_;
  PowerMachine& power_;
  Stopper& stopper_;
  Execution& execution_;
  StateReader& reader_;
  Readings& readings_;
  DriftCheck& drift_;
  const DriveWork& work_;
  EarlierCommands& earlier_;
  SavedPosition& saved_;
  Publisher& publisher_;

  LinkMachine link_;
  std::optional<DriveIdentity> identity_;
};

}  // namespace axisd
