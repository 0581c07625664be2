#pragma once

#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "devices/axis/axis.hpp"
#include "devices/group/group_run.hpp"

namespace axisd::core {

/// The groups of the machine and the moves of groups: accepts them whole or not at all, and remembers them
/// for a while. Thread: core.
class GroupKeeper {
 public:
  struct Parts {
    Executor executor;
    Clock* clock = nullptr;
    CommandBook* book = nullptr;
    std::string instance_id;
    std::function<Axis*(std::string_view)> find;     ///< an axis, or nullptr
    std::function<std::vector<std::string>()> axes;  ///< the names of all
    std::function<void(Task<>, const char*)> launch;
  };
  GroupKeeper(Parts parts, std::vector<GroupSettings> groups)
      : parts_(std::move(parts)), groups_(std::move(groups)) {}
  GroupKeeper(const GroupKeeper&) = delete;

  [[nodiscard]] const std::vector<GroupSettings>& groups() const { return groups_; }
  /// nullptr: there is none.
  [[nodiscard]] const GroupSettings* find(std::string_view group) const;

  /// As GroupAccess::move(): a repeat gets the move of the first request.
  Result<GroupRunPtr> move(GroupMoveRequest request, const CommandOptions& options);
  /// nullptr: unknown, or forgotten.
  [[nodiscard]] GroupRunPtr find_run(std::string_view id) const;

  /// From now on; moves that were accepted go on as they were.
  void configure(std::vector<GroupSettings> groups) { groups_ = std::move(groups); }
  /// The move that still needs the axis; nullptr: none does.
  [[nodiscard]] GroupRunPtr engaged(std::string_view axis) const;
  /// The axis is going away. Precondition: no move needs it.
  void let_go(std::string_view axis);

 private:
  [[nodiscard]] Result<void> check(const GroupMoveRequest& request) const;
  Result<GroupRunPtr> find_repeat(const GroupMoveRequest& request, const std::vector<Action>& actions,
                                  const CommandOptions& options);
  [[nodiscard]] Result<std::vector<Plan>> plan(const GroupMoveRequest& request,
                                               const std::vector<Action>& actions,
                                               const CommandOptions& options) const;
  GroupRunPtr enter(GroupRunPtr run);

  Parts parts_;
  std::vector<GroupSettings> groups_;
  std::uint64_t last_ = 0;
  std::deque<GroupRunPtr> runs_;  ///< the newest last
};

}  // namespace axisd::core
