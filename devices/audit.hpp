// Who asked the machine for what, and what became of it: what the audit is told, and how it is read. The
// files behind it are daemon/store's business.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "devices/access.hpp"
#include "devices/axis/command.hpp"
#include "devices/event.hpp"

namespace axisd {

/// A parameter of a drive that somebody writes, in its own scale.
struct AuditedParameter {
  std::string name;
  std::uint32_t address = 0;
  std::int64_t asked = 0;
  std::optional<std::int64_t> before{}, after{};  ///< as read; nothing: not known
};

/// A change that is no command.
struct AuditedCall {
  enum class Phase : std::uint8_t {
    asked,  ///< before anything is sent for it
    done,
    failed,  ///< `error` says why, and whether anything was changed
  };
  Phase phase = Phase::asked;
  std::string rpc;  ///< "DriveService.WriteParameters"
  std::string client;
  std::string axis{};  ///< empty: it concerns a bus, or the daemon
  std::string bus{};   ///< empty: it concerns an axis, or the daemon
  std::uint64_t lease_token = 0;
  std::string text{};  ///< what it asks for, or what came of it, for people
  std::vector<AuditedParameter> parameters{};
  std::optional<Error> error{};
  CallOriginPtr origin{};  ///< nullptr: not known
};

/// A call that was refused because its client lacks the role, or speaks for somebody else and may not.
struct DeniedCall {
  std::string rpc;  ///< "AxisService.Enable"
  std::string client;
  std::string axis{};          ///< that it names; empty: none, or several
  std::string group{}, bus{};  ///< likewise; empty: none
  Error error;
  std::uint64_t left_out = 0;  ///< as of RefusedCommand
  CallOriginPtr origin{};
};

/// A command that was not accepted.
struct RefusedCommand {
  Command command;             ///< without an id; its cause says why
  std::string group{};         ///< that was to move; empty: it is of an axis
  std::uint64_t left_out = 0;  ///< of its identity before it that are not told: there were too many
};

/// A command of an earlier run of the daemon, as the command journal has it.
struct RecoveredCommand {
  Command command;
  bool sent = false;  ///< its start may have been sent
};

/// The daemon began or ended.
struct DaemonRun {
  enum class What : std::uint8_t { began, ended };
  What what = What::began;
  std::string version;
  std::uint64_t start_count = 0;
};

/// So many entries were left out, as the disk could not be written; or so many stops of one client, as it
/// asked for too many.
struct AuditGap {
  std::uint64_t left_out = 0;
  std::string client{};  ///< empty: it was the disk
};

using AuditContent =
    std::variant<Event, AuditedCall, RefusedCommand, DeniedCall, RecoveredCommand, DaemonRun, AuditGap>;

struct AuditEntry {
  WallTime at{};
  Duration uptime{};  ///< by the monotonic clock: since the computer was started
  AuditContent content;
};

/// Takes what is to be kept. Returns at once and waits for nothing, a stop least of all. Thread: any.
class AuditSink {
 public:
  virtual ~AuditSink() = default;
  virtual void add(AuditEntry entry) = 0;
};

/// Where a look at the audit ended.
struct AuditSeen {
  std::uint64_t cursor = 0;  ///< the newest record that was looked at
  std::uint64_t newest = 0;  ///< of all; 0: there is none
  std::uint64_t oldest = 0;  ///< that is kept; 0: there is none
};

/// The audit as the API reads it. Thread: any.
class AuditAccess {
 public:
  /// A record as it is written; false: enough.
  using Visit = std::function<bool(std::string_view record)>;
  virtual ~AuditAccess() = default;
  /// Shows `visit` the records behind number `after` that may be from `since` or later, the oldest first, and
  /// not more than some thousand of them; then calls `done`. Both on one thread of its own; `done` with
  /// `busy` (too many ask) at once. Not at all if the daemon ends before.
  virtual void look(std::uint64_t after, WallTime since, Visit visit,
                    std::function<void(Result<AuditSeen>)> done) = 0;
};

}  // namespace axisd
