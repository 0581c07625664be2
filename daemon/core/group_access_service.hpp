#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "daemon/core/core_loop.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/group/group.hpp"

namespace axisd::core {

/// What the API can ask of groups: hands it to the core thread, stops through their lane. Thread: any, from
/// construction (before the core runs) to destruction (after it ended).
class GroupAccessService final : public GroupAccess {
 public:
  /// Both outlive it.
  GroupAccessService(CoreLoop& loop, MachineCore& machine) : loop_(&loop), machine_(&machine) {}

  [[nodiscard]] std::vector<GroupSettings> groups() const override { return machine_->table()->groups; }
  void move(GroupMoveRequest request, CommandOptions options, WaitUntil until,
            std::function<void(Result<GroupMove>)> callback) override;
  void start(GroupStartRequest request, WaitUntil until,
             std::function<void(Result<GroupMove>)> callback) override;
  void renew(std::string id, std::string client, GroupRenewal renewal,
             std::function<void(Result<GroupMove>)> callback) override;
  void get(std::string id, std::function<void(Result<GroupMove>)> callback) override;
  void stop(GroupStopRequest request, std::string client, WaitUntil until,
            std::function<void(std::vector<GroupStopResult>)> callback) override;
  void release_stop(GroupReleaseRequest request,
                    std::function<void(std::vector<GroupReleaseResult>)> callback) override;

  /// From now on only stops are accepted.
  void close() { closing_ = true; }

 private:
  struct Gathering;
  using Callback = std::function<void(Result<GroupMove>)>;
  void answer_when(const GroupRunPtr& run, std::function<bool(const GroupRun&)> reached, Callback callback);
  /// Errors: unknown_command; access_denied: another client prepared it.
  [[nodiscard]] Result<GroupRunPtr> find_own(const std::string& id, const std::string& client) const;
  /// A name that there is not, and why.
  using Unknown = std::function<void(const std::string& name, const Error& error)>;
  /// The names of axes that are known, each once.
  static std::vector<std::string> resolve(const MachineTable& table, const std::string& group,
                                          const std::vector<std::string>& axes, const Unknown& unknown);
  void gather(const std::shared_ptr<Gathering>& gathering, std::size_t index,
              const Result<CommandPtr>& command, WaitUntil until);

  CoreLoop* loop_;
  MachineCore* machine_;
  std::atomic<bool> closing_{false};
};

}  // namespace axisd::core
