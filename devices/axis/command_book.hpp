#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "devices/axis/command.hpp"
#include "devices/axis/command_journal.hpp"

namespace axisd {

/// One accepted command while it lives. Ends exactly once; later transitions are ignored. Thread: core.
class CommandRecord {
 public:
  using Observer = std::function<void(const Command&)>;
  CommandRecord(Command command, Clock& clock) : command_(std::move(command)), clock_(&clock) {}

  [[nodiscard]] const Command& value() const { return command_; }
  [[nodiscard]] bool has_ended() const { return ended(command_.state); }
  /// Not set: it has not, or in an earlier run of the daemon.
  [[nodiscard]] TimePoint ended_when() const { return ended_when_; }
  void grant(const MotionValues& granted) { command_.granted = granted; }
  void activate();
  void done() { end(CommandState::done, std::nullopt); }
  void abort(Error cause) { end(CommandState::aborted, std::move(cause)); }
  void error(Error cause) { end(CommandState::error, std::move(cause)); }
  void unknown(Error cause) { end(CommandState::unknown, std::move(cause)); }

  /// Called at each change until the command has ended, while `alive` exists.
  void observe(std::weak_ptr<void> alive, Observer observer);

 private:
  void end(CommandState state, std::optional<Error> cause);
  void tell();

  Command command_;
  Clock* clock_;
  TimePoint ended_when_{};
  std::vector<std::pair<std::weak_ptr<void>, Observer>> observers_;
};
using CommandPtr = std::shared_ptr<CommandRecord>;

/// A command of an earlier run of the daemon of which only reading the drive back tells what became of it.
struct Unsettled {
  CommandPtr command;
  SendingNote note;
  bool tellable = true;  ///< false: something was sent, or may have been, after it
};

/// All commands of the machine: gives ids, remembers ended ones for a while, and makes requests repeatable,
/// over restarts of the daemon too. Thread: core.
class CommandBook {
 public:
  /// `instance_id` makes ids unique across restarts. Without a journal nothing is known of earlier runs.
  CommandBook(Clock& clock, std::string instance_id, CommandJournal* journal = nullptr);

  /// What an earlier request with this id did: its command (same content), nothing (new id), or an error
  /// (request_id_conflict; storage: the journal was damaged, and the id may have been in it; busy: no further
  /// id can be remembered). Requests without an id are never deduplicated.
  Result<CommandPtr> find_repeat(const std::string& axis, const Action& action,
                                 const CommandOptions& options);

  /// Told of each command that is entered from now on.
  void on_open(std::function<void(const CommandPtr&)> opened) { opened_ = std::move(opened); }

  /// Enters an accepted command.
  CommandPtr open(const std::string& axis, const Action& action, const CommandOptions& options);

  /// Another request that was taken into a command: repeats of it get that command. `known`: once they do so
  /// even after a crash; that is the time to do what it asks for.
  void attach(const CommandPtr& command, const std::string& axis, const Action& action,
              const CommandOptions& options, CommandJournal::Callback known);

  /// The command's start is about to be sent: not before `done` came without an error (`storage`).
  void sending(const CommandPtr& command, SendingNote note, CommandJournal::Callback done);

  /// Why nothing new can be started at present: the journal cannot be written.
  [[nodiscard]] std::optional<Error> trouble() const;

  /// What has to be settled for the axis, in order of acceptance. Once: it is handed over.
  [[nodiscard]] std::vector<Unsettled> take_unsettled(const std::string& axis);
  /// Why the axis was in ErrorStop when an earlier run ended: what became of a command was not known. Once.
  [[nodiscard]] std::optional<Error> take_unknown_outcome(const std::string& axis);
  /// Ends what is left of take_unsettled(): of axes that the configuration no longer has.
  void give_up_unsettled();

  /// nullptr: unknown.
  [[nodiscard]] CommandPtr find(const std::string& id) const;

 private:
  struct Entry {
    CommandPtr command;
    std::string digest;
    std::string request_key;
    TimePoint heard_of{};  ///< last
    TimePoint queued{};
    bool sending = false;  ///< told to the journal
  };
  using EntryPtr = std::shared_ptr<Entry>;
  void restore(JournalContent content);
  EntryPtr enter(CommandPtr command, std::string digest, std::string request_key);
  void follow(const EntryPtr& entry);
  void on_change(Entry& entry);
  void forget_old();
  [[nodiscard]] static bool forgettable(const Entry& entry, TimePoint now);
  void forget(const EntryPtr& entry);

  Clock* clock_;
  std::string instance_id_;
  CommandJournal* journal_;
  std::uint64_t last_ = 0;
  std::deque<EntryPtr> named_, unnamed_;  ///< with a request_id and without, by Entry::queued
  std::map<std::string, EntryPtr> by_id_;
  std::map<std::string, EntryPtr> by_request_;  ///< client + request_id
  std::map<std::string, std::vector<Unsettled>> unsettled_;
  std::map<std::string, Error> unknown_outcomes_;
  std::function<void(const CommandPtr&)> opened_;
  TimePoint doubtful_until_{};
  std::string damage_;
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
};

/// The content of a request as text: equal exactly for equal requests.
std::string digest(const std::string& axis, const Action& action);

}  // namespace axisd
