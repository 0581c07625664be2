#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "buses/clock.hpp"
#include "devices/axis/command_digest.hpp"
#include "devices/axis/command_journal.hpp"
#include "devices/axis/command_record.hpp"
#include "devices/axis/id_limits.hpp"
#include "devices/axis/known_ids.hpp"

namespace axisd {

/// A command of an earlier run of the daemon of which only reading the drive back tells what became of it.
struct Unsettled {
  CommandPtr command;
  SendingNote note;
  bool tellable = true;  ///< false: something was sent, or may have been, after it
};

/// All commands of the machine: gives ids, remembers ended ones for a while, and makes requests repeatable,
/// over restarts of the daemon too. How much it remembers is bounded, in all and of each client (M32).
/// Thread: core.
class CommandBook {
 public:
  /// `instance_id` makes ids unique across restarts. Without a journal nothing is known of earlier runs.
  CommandBook(Clock& clock, std::string instance_id, CommandJournal* journal = nullptr, IdLimits limits = {});

  /// What an earlier request with this id did: its command (same content), nothing (new id), or an error
  /// (request_id_conflict; storage: the journal was damaged, and the id may have been in it; busy: no further
  /// id of this client can be remembered at present). Of a command that ended long ago, with many since, the
  /// repeat gets what is still known: see KnownIds. Requests without an id are never deduplicated.
  Result<CommandPtr> find_repeat(const std::string& axis, const Action& action,
                                 const CommandOptions& options);

  /// Why requests with an id that is not known are refused at present: the journal was damaged, so they may
  /// have been executed before. `axis`: that is asked for, if any. Thread: any.
  [[nodiscard]] std::optional<Error> doubt(const std::string& axis = {}) const;

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

  /// Why nothing new can be started at present: the journal cannot be written. Thread: any.
  [[nodiscard]] std::optional<Error> trouble() const;

  /// Commands that an earlier run of the daemon had not ended: some have ended since. Once: it is handed
  /// over.
  [[nodiscard]] std::vector<CommandPtr> take_interrupted() { return std::exchange(interrupted_, {}); }
  /// What has to be settled for the axis, in order of acceptance. Once: it is handed over.
  [[nodiscard]] std::vector<Unsettled> take_unsettled(const std::string& axis);
  /// Why the axis was in ErrorStop when an earlier run ended: what became of a command was not known. Once.
  [[nodiscard]] std::optional<Error> take_unknown_outcome(const std::string& axis);
  /// Ends what is left of take_unsettled(): of axes that the configuration no longer has.
  void give_up_unsettled();

  /// nullptr: unknown, or its details are not remembered.
  [[nodiscard]] CommandPtr find(const std::string& id) const;
  /// Request ids that are remembered, of all clients.
  [[nodiscard]] std::size_t ids() const { return ids_; }

 private:
  struct Entry {
    CommandPtr command;
    RequestKey request;
    TimePoint heard_of{};  ///< last
    TimePoint queued{};
    bool sending = false;  ///< told to the journal
  };
  using EntryPtr = std::shared_ptr<Entry>;
  /// What is remembered of one client's requests.
  struct ClientIds {
    std::unordered_map<std::string, EntryPtr> by_request;
    std::deque<EntryPtr> detailed;  ///< all of these, about in the order in which they were entered
    KnownIds known;                 ///< what has ended, without details
    [[nodiscard]] std::size_t size() const { return detailed.size() + known.size(); }
  };
  void restore(JournalContent content);
  EntryPtr enter(CommandPtr command, RequestKey request, TimePoint heard_of);
  void follow(const EntryPtr& entry);
  void on_change(Entry& entry);
  [[nodiscard]] static TimePoint last_heard_of(const Entry& entry);
  void heard(Entry& entry);
  Result<CommandPtr> known_repeat(KnownIds::Found found, const std::string& axis, const Action& action,
                                  const CommandOptions& options);
  // command_quota.cpp
  [[nodiscard]] std::size_t ids_of(const std::string& client) const;
  [[nodiscard]] bool has_room(const std::string& client) const;
  Result<void> make_room(const std::string& client);
  [[nodiscard]] Error no_room(const std::string& client) const;
  [[nodiscard]] std::optional<TimePoint> next_free(const ClientIds& ids) const;
  std::size_t forget_some(ClientIds& ids, TimePoint then);
  void forget(const EntryPtr& entry);
  void forget_old();
  void forget_unnamed(TimePoint now);
  void shorten();
  bool shorten(ClientIds& ids);

  Clock* clock_;
  std::string instance_id_;
  CommandJournal* journal_;
  IdLimits limits_;
  std::uint64_t last_ = 0;
  std::map<std::string, ClientIds> clients_;
  std::size_t detailed_ = 0, ids_ = 0;  ///< of all clients; ids_: remembered, with and without details
  std::string looked_at_;               ///< the client whose ids were looked through last
  std::deque<EntryPtr> unnamed_;        ///< without a request_id, by Entry::queued
  std::unordered_map<std::string, EntryPtr> by_id_;
  std::vector<CommandPtr> interrupted_;
  std::map<std::string, std::vector<Unsettled>> unsettled_;
  std::map<std::string, Error> unknown_outcomes_;
  std::function<void(const CommandPtr&)> opened_;
  TimePoint doubtful_until_{};  ///< this and what was damaged are known from the start
  std::string damage_;
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
};

}  // namespace axisd
