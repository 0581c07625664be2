#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/signal.hpp"
#include "buses/start_turns.hpp"
#include "buses/task.hpp"
#include "devices/axis/member.hpp"
#include "devices/group/group.hpp"
#include "devices/group/group_machine.hpp"

namespace axisd {

/// One group move, from its acceptance on. All members are loaded, read and judged before the first start
/// frame; what starts by a SYNC starts first, since only that can still be called off by all; then each
/// further start is sent when the one before is known to be good; between two of them, who moves already is
/// looked at. Whatever fails, and whoever stops a member, stops all: those that may move first (M22).
///
/// A move that starts when told (group_moment.cpp) does all of that up to its first start twice: to find what
/// could forbid it, and right before its moment, so that what its starts rest on is as fresh as that of any
/// other (M6). In between its drives are free of it. From when it was told on it has to be renewed. Thread:
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
  /// It starts when told, and has come as far, or has ended.
  [[nodiscard]] bool prepared() const {
    return machine_.state() != GroupMachine::State::preparing || ended(state());
  }
  /// As GroupAccess::start(), whoever asks.
  Result<void> start_at(TimePoint at);
  /// It goes on for `renewal_limit`, if it was told to start.
  void renew(GroupRenewal renewal);
  /// Whoever coordinates it renews it several times in between.
  static constexpr Duration renewal_limit = std::chrono::milliseconds(500);
  /// So long after it was prepared it is given up, unless it has started.
  static constexpr Duration longest_preparation = std::chrono::seconds(2);
  /// By how much the first start may miss its moment, or nothing starts: for so long a node that does not
  /// answer, or a computer that is busy, may be in its way.
  static constexpr Duration latest_start = std::chrono::milliseconds(50);

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
  /// Loads, reads and judges all.
  Task<MaybeFailure> examine();
  /// One step with each member, one after the other.
  Task<MaybeFailure> each(Step step);
  Task<> take_turns();
  Task<MaybeFailure> start();
  Task<MaybeFailure> start_by_sync(std::vector<std::size_t> together, PreparedMove::StartWindow window);
  void tie(TimePoint not_after);
  Task<MaybeFailure> look_after_the_started();
  [[nodiscard]] std::vector<std::vector<std::size_t>> common_starts() const;
  [[nodiscard]] MaybeFailure unready() const;
  [[nodiscard]] Failure attributed(std::size_t member, Error cause) const;
  [[nodiscard]] std::size_t member_at(const Address& where, const std::vector<std::size_t>& among) const;
  [[nodiscard]] MaybeFailure check_arrival() const;
  void on_change(std::size_t member);
  void give_up(const Failure& failure);
  void give_up(const Error& common);
  void begin_to_give_up(Error cause);
  void tell();
  [[nodiscard]] std::optional<Error> cause() const;
  [[nodiscard]] bool given_up() const { return machine_.given_up(); }

  // group_moment.cpp
  Task<MaybeFailure> await_moment();
  Task<MaybeFailure> approach(std::size_t first);
  Task<> pause_until(TimePoint when);
  void note_times(Duration examination, Duration verification);
  [[nodiscard]] Duration sync_approach() const;

  Parts parts_;
  std::vector<std::unique_ptr<Axis::Member>> members_;
  std::vector<CommandPtr> commands_;
  std::vector<bool> by_sync_;
  std::vector<Observer> observers_;
  std::vector<StartTurns::Turn> turns_;  ///< until all have started
  std::optional<Error> cause_;
  GroupMachine machine_;
  bool running_ = false;
  std::optional<GroupPreparation> preparation_;  ///< of one that starts when told
  Duration verifying_{};                         ///< of one member took so long
  std::shared_ptr<void> hold_;                   ///< of the bus of the first start
  Clock::Timer unrenewed_;
  Signal news_;  ///< it was told, or given up
};
using GroupRunPtr = std::shared_ptr<GroupRun>;

}  // namespace axisd
