// What must be known of commands after a restart, as the axes see it. The file behind it is daemon/store's
// business.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "buses/error.hpp"
#include "devices/axis/command.hpp"
#include "devices/axis/known_ids.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// By what a drive that is read back tells whether it executed a start. In counts of its own counter.
struct SendingNote {
  std::optional<std::int32_t> start_pulses{};   ///< where it stands; nothing: reading back tells nothing
  std::optional<std::int32_t> target_pulses{};  ///< where it ends (of a homing: its compensation)
  std::int64_t tolerance_pulses = 0;            ///< so far from the target it may come to rest
  std::vector<ContinuityMark> marks{};          ///< one of them is found, unless its memory was lost
  bool operator==(const SendingNote&) const = default;
};

/// The id of one request, and what was asked by it.
struct RequestKey {
  std::string client;
  std::string request_id;
  std::string digest;
  bool operator==(const RequestKey&) const = default;
};

/// A command of an earlier run of the daemon.
struct JournalledCommand {
  Command command;                     ///< ended, or accepted: then the daemon ended first
  std::string digest;                  ///< of the request that it was accepted for
  bool sent = false;                   ///< its start may have been sent
  SendingNote note{};                  ///< with `sent`
  std::vector<RequestKey> attached{};  ///< further requests that were taken into it
  TimePoint heard_of{};                ///< last, by the journal's time
};

/// Ids of one client's commands that have ended, of which no more is kept.
struct ClientRun {
  std::string client;
  IdRun run;  ///< by the journal's time
};

/// Everything that is known of earlier runs.
struct JournalContent {
  std::vector<JournalledCommand> commands{};  ///< in order of acceptance
  std::vector<ClientRun> ids{};               ///< those that were heard of first come first
  TimePoint now{};  ///< by the journal's time, which goes on over restarts: never too late
  /// Axes whose last outcome was unknown, and has not been reset since: the command's id and cause.
  std::map<std::string, std::pair<std::string, Error>> unknown_outcomes{};
  /// The journal was damaged: an id that is not in it may have been used all the same, until then.
  std::optional<WallTime> doubtful_until{};
  std::string damage{};  ///< what was wrong
};

/// Remembers commands over restarts. Calls return at once; nothing waits for the disk, a stop least of all.
/// `done` (may be empty) is called exactly once, later, on the core thread. What is told later is never on
/// the disk without what was told before. Thread: core.
class CommandJournal {
 public:
  using Callback = std::function<void(Result<void>)>;
  virtual ~CommandJournal() = default;

  /// What was kept when the daemon started. Once: it is handed over.
  [[nodiscard]] virtual JournalContent take_loaded() = 0;
  /// Why nothing can be written at present; nothing: all is well. Thread: any.
  [[nodiscard]] virtual std::optional<Error> trouble() const = 0;

  virtual void accepted(const Command& command, std::string digest) = 0;
  /// A further request was taken into the command. `done` comes when a crash of the daemon (not of the
  /// computer) leaves it known.
  virtual void attached(const std::string& command, RequestKey request, Callback done) = 0;
  /// The command's start is about to be sent. `done` comes when that is durable; only then it may be. Error
  /// `storage`: it must not be.
  virtual void sending(const Command& command, SendingNote note, Callback done) = 0;
  virtual void ended(const Command& command) = 0;
  /// A command that has ended was asked for again.
  virtual void heard(const Command& command, RequestKey request) = 0;
};

}  // namespace axisd
