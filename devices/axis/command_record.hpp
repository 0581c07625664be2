#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>
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

}  // namespace axisd
