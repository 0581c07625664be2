#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/core/bus_access_service.hpp"
#include "daemon/core/bus_watch_service.hpp"
#include "daemon/core/core_loop.hpp"
#include "daemon/core/drive_access_service.hpp"
#include "daemon/core/group_access_service.hpp"
#include "daemon/core/lease_access_service.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/machine.hpp"

namespace axisd::core {

/// The machine as the API sees it: hands requests to the core thread, stops through the lane. Thread: any,
/// from construction (before the core runs) to destruction (after it ended).
class MachineService final : public Machine {
 public:
  MachineService(CoreLoop& loop, MachineCore& machine, std::string name, std::string instance_id);

  [[nodiscard]] std::vector<std::string> axis_names() const override;
  [[nodiscard]] AxisSnapshotPtr snapshot(std::string_view axis) const override;
  [[nodiscard]] MachineInfo info() const override;
  void submit(std::string axis, Action action, CommandOptions options, WaitUntil until,
              CommandCallback callback) override;
  void explain(std::string axis, std::optional<Action> action, CommandOptions options,
               std::function<void(Result<std::vector<Obstacle>>)> callback) override;
  void release_stop(std::string axis, HoldRelease release,
                    std::function<void(Result<StopReleased>)> callback) override;
  void stop_all(Requester requester, WaitUntil until, std::function<void(AllStopped)> callback) override;
  void release_inhibit(std::string client, std::function<void(Result<void>)> callback) override;
  [[nodiscard]] std::size_t stops_waiting(const std::string& identity) const override {
    return loop_->lane().waiting(identity);
  }
  void kept_state(std::function<void(KeptStateReport)> callback) override;
  void accept_state(std::string client,
                    std::function<void(Result<std::vector<Conviction>>)> callback) override;
  void list_commands(std::string axis, std::size_t most,
                     std::function<void(std::vector<Command>)> callback) override;
  void get_command(std::string id, CommandCallback callback) override;
  std::shared_ptr<void> watch_command(std::string id, CommandCallback callback) override;
  void cancel_command(std::string id, std::string client, CommandCallback callback) override;
  void buses(std::function<void(std::vector<BusStatus>)> callback) override;
  void budgets(std::function<void(std::vector<BusBudgetReport>)> callback) override;
  [[nodiscard]] DriveAccess& drive_access() override { return drive_access_; }
  [[nodiscard]] BusAccess& bus_access() override { return bus_access_; }
  [[nodiscard]] BusWatch& bus_watch() override { return bus_watch_; }
  [[nodiscard]] LeaseAccess& lease_access() override { return lease_access_; }
  [[nodiscard]] GroupAccess& group_access() override { return group_access_; }
  [[nodiscard]] EventSource& events() override { return machine_->events(); }
  void on_published(std::function<void()> notify) override;
  [[nodiscard]] WallTime wall(TimePoint t) const override { return loop_->clock().wall(t); }
  [[nodiscard]] TimePoint now() const override { return loop_->clock().now(); }

  /// As MachineCore::reload(), or, with `dry_run`, check_reload(). Calls back on the core thread.
  void reload(Reload reload, bool dry_run, ReloadDone done);
  /// From now on everything but stops is refused: the daemon is going down.
  void close() {
    closing_ = true;
    group_access_.close();
  }
  /// Called by the core after each publication.
  void published() const;

 private:
  struct Latch;
  void answer(const Result<CommandPtr>& command, WaitUntil until, CommandCallback callback);
  void submit_held(const std::string& axis, const StopRequest& request, const CommandOptions& options,
                   WaitUntil until, CommandCallback callback);

  CoreLoop* loop_;
  MachineCore* machine_;
  DriveAccessService drive_access_;
  BusAccessService bus_access_;
  BusWatchService bus_watch_;
  LeaseAccessService lease_access_;
  GroupAccessService group_access_;
  std::string name_;
  std::string instance_id_;
  std::atomic<bool> closing_{false};
  std::function<void()> notify_;
};

}  // namespace axisd::core
