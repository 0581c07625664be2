#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "devices/axis/command.hpp"

namespace axisd {

/// One accepted command while it lives. Ends exactly once; later transitions are ignored. Thread: core.
class CommandRecord {
 public:
  using Observer = std::function<void(const Command&)>;
  CommandRecord(Command command, Clock& clock) : command_(std::move(command)), clock_(&clock) {}

  [[nodiscard]] const Command& value() const { return command_; }
  [[nodiscard]] bool has_ended() const { return ended(command_.state); }
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
  std::vector<std::pair<std::weak_ptr<void>, Observer>> observers_;
};
using CommandPtr = std::shared_ptr<CommandRecord>;

/// All commands of the machine: gives ids, remembers ended ones for a while, and makes motion requests
/// repeatable. Thread: core.
class CommandBook {
 public:
  /// `instance_id` makes ids unique across restarts.
  CommandBook(Clock& clock, std::string instance_id);

  /// What an earlier request with this id did: its command (same content), nothing (new id), or an error
  /// (request_id_conflict). Requests without an id are never deduplicated.
  Result<CommandPtr> find_repeat(const std::string& axis, const Action& action,
                                 const CommandOptions& options) const;

  /// Enters an accepted command.
  CommandPtr open(const std::string& axis, const Action& action, const CommandOptions& options);

  /// Another request that was taken into a command: repeats of it get that command.
  void attach(const CommandPtr& command, const std::string& axis, const Action& action,
              const CommandOptions& options);

  /// nullptr: unknown.
  [[nodiscard]] CommandPtr find(const std::string& id) const;

 private:
  struct Entry {
    CommandPtr command;
    std::string digest;
    std::string request_key;
    TimePoint entered;
  };
  void forget_old();

  Clock* clock_;
  std::string instance_id_;
  std::uint64_t last_ = 0;
  std::deque<std::shared_ptr<Entry>> order_;
  std::map<std::string, std::shared_ptr<Entry>> by_id_;
  std::map<std::string, std::shared_ptr<Entry>> by_request_;  ///< client + request_id
};

/// The content of a request as text: equal exactly for equal requests.
std::string digest(const std::string& axis, const Action& action);

}  // namespace axisd
