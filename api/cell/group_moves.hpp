// GroupMoveMachine, with machines to ask.
#pragma once

#include <grpcpp/support/status.h>

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "api/cell/callers.hpp"
#include "api/cell/group_move_machine.hpp"
#include "api/cell/routes.hpp"
#include "axisd/cell/v1/cell_service.pb.h"
#include "buses/clock.hpp"

namespace axisd::cell {

/// The moves of several machines that this entrance coordinates, and some that have ended. Thread: core.
class GroupMoves {
 public:
  /// `routes` and `clock` outlive this. `told`: how moves come along.
  GroupMoves(boost::asio::any_io_executor core, Clock& clock, const RouteTable& routes,
             std::function<void(v1::CellEvent)> told)
      : core_(std::move(core)), clock_(clock), routes_(routes), told_(std::move(told)) {}

  using Answer = std::function<void(const grpc::Status&, const v1::MoveGroupResponse&)>;
  /// Begins a move, or attaches to the one of that request_id. `start_by`: the caller waits no longer, so
  /// that nobody starts later. `answer`: once it has come as far as the request says, or was refused.
  void move(const Caller& caller, const v1::MoveGroupRequest& request, TimePoint start_by, Answer answer);
  /// Nobody is renewed any more, so that all stop by themselves; whoever waits is told `why`, or that the
  /// move may have run in part.
  void end(const grpc::Status& why);
  /// That have not ended.
  [[nodiscard]] int open() const;
  /// How many ended how, as this entrance knows it.
  struct Tally {
    std::uint64_t done = 0;
    std::uint64_t otherwise = 0;  ///< aborted, or failed
    std::uint64_t unknown = 0;    ///< a machine did not say what became of it
    std::uint64_t refused = 0;    ///< this entrance has started nothing
  };
  [[nodiscard]] const Tally& tally() const { return tally_; }

  /// Of one client, and of all, that have not ended.
  static constexpr int most_of_one = 8, most = 64;
  /// So many that have ended are remembered, for those who ask again.
  static constexpr std::size_t most_ended = 256;
  static constexpr std::size_t most_machines = 128;
  /// Of one request, over all machines.
  static constexpr int most_targets = 1024;
  /// Of all that have ended and are remembered.
  static constexpr int most_ended_targets = 16 * most_targets;
  static constexpr std::size_t longest_name = 64, most_bytes = std::size_t{256} * 1024;

 private:
  struct Run;
  using RunPtr = std::shared_ptr<Run>;
  [[nodiscard]] RunPtr find(const Caller& caller, const std::string& request_id) const;
  [[nodiscard]] static grpc::Status check(const Caller& caller, const v1::MoveGroupRequest& request);
  [[nodiscard]] grpc::Status check_room(const Caller& caller) const;
  /// The connections to its machines; or why one cannot be asked.
  [[nodiscard]] grpc::Status connect(Run& run) const;
  void perform(const RunPtr& run, const GroupMoveMachine::Errands& errands);
  void perform(const RunPtr& run, const GroupMoveMachine::Errand& errand);
  void prepare(const RunPtr& run, std::size_t machine);
  void tell(const RunPtr& run, std::size_t machine, Duration at);
  void renew(const RunPtr& run, const GroupMoveMachine::Errand& errand);
  void cancel(const RunPtr& run, std::size_t machine);
  void look(const RunPtr& run, std::size_t machine);
  using Event = GroupMoveMachine::Errands (GroupMoveMachine::*)(std::size_t, const GroupMoveMachine::Answer&);
  /// What is to be done with an answer: `event` of the run's machine.
  template <class Response>
  auto taker(const RunPtr& run, std::size_t machine, Event event);
  void tick(const RunPtr& run);
  void tell_steps(Run& run) const;
  void settle(const RunPtr& run);
  void close(Run& run);
  void forget_oldest();

  boost::asio::any_io_executor core_;
  Clock& clock_;
  const RouteTable& routes_;
  const std::function<void(v1::CellEvent)> told_;
  std::list<RunPtr> runs_;  ///< oldest first
  Tally tally_;
};

}  // namespace axisd::cell
