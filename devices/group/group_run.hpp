#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/start_turns.hpp"
#include "buses/task.hpp"
#include "devices/axis/member.hpp"
#include "devices/group/group.hpp"

namespace axisd {

/// One group move, from its acceptance on. All members are loaded, read and judged before the first start
/// frame; what starts by a SYNC starts first, since only that can still be called off by all; then each
/// further start is sent when the one before is known to be good; between two of them, who moves already is
/// looked at. Whatever fails, and whoever stops a member, stops all: those that may move first (M22). Thread:
/// core.
class GroupRun : public std::enable_shared_from_this<GroupRun> {
 public:
  struct Parts {
    Executor executor;
    Clock* clock = nullptr;
    std::string id;
    GroupMoveRequest request;
  };
  /// Called at each change; true: not again.
  using Observer = std::function<bool(const GroupRun&)>;

  GroupRun(Parts parts, std::vector<std::unique_ptr<Axis::Member>> members);
  /// Of an earlier run of the daemon: what is left of it are its commands.
  GroupRun(Parts parts, std::vector<CommandPtr> commands);
  GroupRun(const GroupRun&) = delete;

  /// Begins to look at its members' commands; then run() is to be run, once.
  void watch_members();
  Task<> run();

  [[nodiscard]] const std::string& id() const { return parts_.id; }
  [[nodiscard]] const std::vector<CommandPtr>& commands() const { return commands_; }
  [[nodiscard]] GroupMove value() const;
  [[nodiscard]] CommandState state() const;
  void observe(Observer observer);

  [[nodiscard]] bool moves(std::string_view axis) const;
  /// All members have ended, and nothing is left to be done for them.
  [[nodiscard]] bool over() const { return !running_ && ended(state()); }
  /// An axis of it is going away: only what is known of the move stays. Precondition: it is over.
  void let_go();

 private:
  struct Failure {
    std::size_t member;
    Error cause;
  };
  using MaybeFailure = std::optional<Failure>;

  using Step = Task<Result<void>> (Axis::Member::*)();

  Task<MaybeFailure> prepare();
  /// One step with each member, one after the other.
  Task<MaybeFailure> each(Step step);
  Task<> take_turns();
  Task<MaybeFailure> start();
  Task<MaybeFailure> start_by_sync(std::vector<std::size_t> together);
  Task<MaybeFailure> look_after_the_started();
  [[nodiscard]] std::vector<std::vector<std::size_t>> common_starts() const;
  [[nodiscard]] MaybeFailure unready() const;
  [[nodiscard]] Failure attributed(std::size_t member, Error cause) const;
  [[nodiscard]] std::size_t member_at(const Address& where, const std::vector<std::size_t>& among) const;
  [[nodiscard]] MaybeFailure check_arrival() const;
  void on_change(std::size_t member);
  void give_up(const Failure& failure);
  void tell();

  Parts parts_;
  std::vector<std::unique_ptr<Axis::Member>> members_;
  std::vector<CommandPtr> commands_;
  std::vector<bool> by_sync_;
  std::vector<Observer> observers_;
  std::vector<StartTurns::Turn> turns_;  ///< until all have started
  std::optional<Error> cause_;
  bool given_up_ = false;
  bool running_ = false;
};
using GroupRunPtr = std::shared_ptr<GroupRun>;

}  // namespace axisd
