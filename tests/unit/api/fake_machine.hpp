// A machine that does what the test says, with a core thread of its own.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "devices/machine.hpp"
#include "tests/unit/api/fake_access.hpp"

namespace axisd::testing {

class FakeMachine final : public Machine {
 public:
  struct Submitted {
    std::string axis;
    Action action;
    CommandOptions options;
    WaitUntil until;
  };

  FakeMachine();
  ~FakeMachine() override;

  // What the test controls. Thread: any.
  void publish(AxisSnapshot snapshot);
  /// All further calls are answered with this error; nullopt: with a command.
  void refuse_with(std::optional<Error> error);
  /// Keeps callbacks back until let_go().
  void hold();
  void let_go();
  /// Runs those that are kept back, and what they bring, on this thread, in place of the core's.
  void run_held();
  /// A change of command "c-1" for those who watch it.
  void change(const Command& command);
  void set_now(TimePoint now) { now_ = now; }
  /// So many of its stops wait for the core.
  void let_stops_wait(const std::string& client, std::size_t axes);
  std::optional<Error> latch_trouble{};  ///< that StopAll answers with; set before it is called
  KeptStateReport state_report{};        ///< likewise
  std::optional<Error> storage_error{};  ///< likewise

  FakeDrives& drives() { return drives_; }
  FakeBuses& nodes() { return buses_; }
  FakeWatch& watch() { return watch_; }
  FakeLeases& leases() { return leases_; }
  FakeGroups& groups() { return groups_; }
  FakeEvents& event_log() { return events_; }

  [[nodiscard]] std::vector<Submitted> submitted() const;
  [[nodiscard]] std::vector<std::string> log()
      const;  ///< other calls: "release_stop feeder", "stop_all unix:anna" ...
  [[nodiscard]] std::size_t held() const;
  [[nodiscard]] std::size_t watchers() const;

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
  void kept_state(std::function<void(KeptStateReport)> callback) override;
  void accept_state(std::string client,
                    std::function<void(Result<std::vector<Conviction>>)> callback) override;
  void release_inhibit(std::string client, std::function<void(Result<void>)> callback) override;
  [[nodiscard]] std::size_t stops_waiting(const std::string& client) const override;
  void list_commands(std::string axis, std::size_t most,
                     std::function<void(std::vector<Command>)> callback) override;
  void get_command(std::string id, CommandCallback callback) override;
  std::shared_ptr<void> watch_command(std::string id, CommandCallback callback) override;
  void cancel_command(std::string id, std::string client, CommandCallback callback) override;
  void buses(std::function<void(std::vector<BusStatus>)> callback) override;
  void budgets(std::function<void(std::vector<BusBudgetReport>)> callback) override;
  [[nodiscard]] DriveAccess& drive_access() override { return drives_; }
  [[nodiscard]] BusAccess& bus_access() override { return buses_; }
  [[nodiscard]] BusWatch& bus_watch() override { return watch_; }
  [[nodiscard]] LeaseAccess& lease_access() override { return leases_; }
  [[nodiscard]] GroupAccess& group_access() override { return groups_; }
  [[nodiscard]] EventSource& events() override { return events_; }
  void on_published(std::function<void()> notify) override;
  [[nodiscard]] WallTime wall(TimePoint t) const override;
  [[nodiscard]] TimePoint now() const override { return now_; }

 private:
  using Job = std::function<void()>;
  void post(Job job);
  void answer(const CommandCallback& callback, Result<Command> result);
  [[nodiscard]] Result<Command> result_of(std::string axis, CommandKind kind);
  void note(std::string line);

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Job> jobs_, held_;
  bool holding_ = false, stopping_ = false;
  std::map<std::string, AxisSnapshotPtr, std::less<>> snapshots_;
  std::optional<Error> refusal_;
  std::vector<Submitted> submitted_;
  std::vector<std::string> log_;
  std::map<std::string, std::size_t> stops_waiting_;
  std::vector<std::weak_ptr<CommandCallback>> watchers_;
  std::function<void()> notify_ = [] {};
  std::atomic<TimePoint> now_{TimePoint(std::chrono::hours(1))};
  FakeDrives drives_{[this](Job job) { post(std::move(job)); }};
  FakeBuses buses_{[this](Job job) { post(std::move(job)); }};
  FakeWatch watch_{[this](Job job) { post(std::move(job)); }};
  FakeLeases leases_{[this](Job job) { post(std::move(job)); }};
  FakeGroups groups_{[this](Job job) { post(std::move(job)); }};
  FakeEvents events_{[this](Job job) { post(std::move(job)); }};
  std::thread core_;
};

}  // namespace axisd::testing
