#include "tests/unit/api/fake_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/smart_ptr/make_shared.hpp>
#include <utility>

namespace axisd::testing {

using namespace std::chrono_literals;

FakeMachine::FakeMachine() {
  for (const auto* name : {"feeder", "turntable"})
    publish({.name = name, .bus = "line-a", .node = 1, .model = "ykd2405pr", .unit = "mm"});
  core_ = std::thread([this] {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
      if (stopping_) return;
      auto jobs = std::exchange(jobs_, {});
      lock.unlock();
      for (auto& job : jobs) job();
      jobs.clear();
      lock.lock();
    }
  });
}

FakeMachine::~FakeMachine() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  core_.join();
}

void FakeMachine::post(Job job) {
  {
    const std::lock_guard lock(mutex_);
    (holding_ ? held_ : jobs_).push_back(std::move(job));
    if (holding_) return;
  }
  wake_.notify_one();
}

void FakeMachine::run_held() {
  std::vector<Job> jobs;
  do {
    for (auto& job : jobs) job();
    const std::lock_guard lock(mutex_);
    jobs = std::exchange(held_, {});
  } while (!jobs.empty());
}

void FakeMachine::publish(AxisSnapshot snapshot) {
  std::function<void()> notify;
  {
    const std::lock_guard lock(mutex_);
    auto name = snapshot.name;
    snapshots_[std::move(name)] = boost::make_shared<const AxisSnapshot>(std::move(snapshot));
    notify = notify_;
  }
  notify();
}

void FakeMachine::refuse_with(std::optional<Error> error) {
  const std::lock_guard lock(mutex_);
  refusal_ = std::move(error);
}

void FakeMachine::hold() {
  const std::lock_guard lock(mutex_);
  holding_ = true;
}

void FakeMachine::let_go() {
  {
    const std::lock_guard lock(mutex_);
    holding_ = false;
    std::ranges::move(std::exchange(held_, {}), std::back_inserter(jobs_));
  }
  wake_.notify_one();
}

void FakeMachine::change(const Command& command) {
  post([this, command] {
    std::vector<std::shared_ptr<CommandCallback>> watchers;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& watcher : watchers_)
        if (auto alive = watcher.lock()) watchers.push_back(std::move(alive));
    }
    for (const auto& watcher : watchers) (*watcher)(command);
  });
}

std::vector<FakeMachine::Submitted> FakeMachine::submitted() const {
  const std::lock_guard lock(mutex_);
  return submitted_;
}

std::vector<std::string> FakeMachine::log() const {
  const std::lock_guard lock(mutex_);
  return log_;
}

std::size_t FakeMachine::held() const {
  const std::lock_guard lock(mutex_);
  return held_.size();
}

std::size_t FakeMachine::watchers() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::ranges::count_if(watchers_, [](const auto& w) { return !w.expired(); }));
}

std::vector<std::string> FakeMachine::axis_names() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  names.reserve(snapshots_.size());
  for (const auto& [name, snapshot] : snapshots_) names.push_back(name);
  return names;
}

AxisSnapshotPtr FakeMachine::snapshot(std::string_view axis) const {
  const std::lock_guard lock(mutex_);
  const auto found = snapshots_.find(axis);
  return found == snapshots_.end() ? nullptr : found->second;
}

MachineInfo FakeMachine::info() const {
  return {.machine = "press-1",
          .version = "0.1",
          .instance_id = "i-1",
          .inhibited = true,
          .inhibited_by = "hmi",
          .state_unaccepted = state_report.convictions.empty() ? "" : to_string(state_report.convictions),
          .storage_error = storage_error};
}

Result<Command> FakeMachine::result_of(std::string axis, CommandKind kind) {
  const std::lock_guard lock(mutex_);
  if (refusal_) return fail(*refusal_);
  return Command{.id = "c-1", .axis = std::move(axis), .kind = kind, .state = CommandState::active};
}

void FakeMachine::answer(const CommandCallback& callback, Result<Command> result) {
  post([callback, result = std::move(result)] { callback(result); });
}

void FakeMachine::note(std::string line) {
  const std::lock_guard lock(mutex_);
  log_.push_back(std::move(line));
}

void FakeMachine::submit(std::string axis, Action action, CommandOptions options, WaitUntil until,
                         CommandCallback callback) {
  auto result = result_of(axis, kind_of(action));
  if (result) result->client = options.client;
  {
    const std::lock_guard lock(mutex_);
    submitted_.push_back({std::move(axis), std::move(action), std::move(options), until});
  }
  answer(callback, std::move(result));
}

void FakeMachine::explain(std::string axis, std::optional<Action> action, CommandOptions options,
                          std::function<void(Result<std::vector<Obstacle>>)> callback) {
  note(fmt::format("explain {} {} by {} token {}", axis, action ? to_string(kind_of(*action)) : "motion",
                   options.client, options.lease_token));
  const std::vector<Obstacle> found = {
      {.error = {.reason = Reason::soft_limit,
                 .message = "too far",
                 .remedy = "stay within",
                 .permitted = Range{.minimum = 0, .maximum = 400, .unit = "mm"}}},
      {.error = {.reason = Reason::moving, .message = "it moves"}, .blocking = false}};
  post([callback = std::move(callback), found] { callback(found); });
}

void FakeMachine::release_stop(std::string axis, HoldRelease release,
                               std::function<void(Result<StopReleased>)> callback) {
  note("release_stop " + axis + " " + text_of(release));
  auto stop = result_of(std::move(axis), CommandKind::stop);
  Result<StopReleased> released =
      stop ? Result<StopReleased>(
                 StopReleased{.stop = *stop, .holds = {{.key = {.holder = "hmi", .request_id = "r-1"}}}})
           : Result<StopReleased>(fail(stop.error()));
  post([callback = std::move(callback), released = std::move(released)] { callback(released); });
}

void FakeMachine::stop_all(Requester requester, WaitUntil until, std::function<void(AllStopped)> callback) {
  note("stop_all " + requester.client + (until == WaitUntil::done ? " done" : " accepted"));
  AllStopped answer{
      .stops = {result_of("feeder", CommandKind::stop), fail(Reason::not_confirmed, "still moving")},
      .not_durable = latch_trouble};
  post([callback = std::move(callback), answer = std::move(answer)] { callback(answer); });
}

void FakeMachine::kept_state(std::function<void(KeptStateReport)> callback) {
  note("kept_state");
  post([callback = std::move(callback), report = state_report] { callback(report); });
}

void FakeMachine::accept_state(std::string client,
                               std::function<void(Result<std::vector<Conviction>>)> callback) {
  note("accept_state " + client);
  post([callback = std::move(callback), accepted = state_report.convictions] { callback(accepted); });
}

void FakeMachine::release_inhibit(std::string client, std::function<void(Result<void>)> callback) {
  note("release_inhibit " + client);
  post([callback = std::move(callback)] { callback({}); });
}

void FakeMachine::list_commands(std::string axis, std::size_t most,
                                std::function<void(std::vector<Command>)> callback) {
  note(fmt::format("list_commands {} {}", axis, most));
  post([callback = std::move(callback)] {
    callback({{.id = "c-2", .axis = "feeder", .client = "hmi"}, {.id = "c-1", .axis = "feeder"}});
  });
}

void FakeMachine::get_command(std::string id, CommandCallback callback) {
  note("get_command " + id);
  answer(callback, result_of("feeder", CommandKind::home));
}

std::shared_ptr<void> FakeMachine::watch_command(std::string id, CommandCallback callback) {
  note("watch_command " + id);
  auto watcher = std::make_shared<CommandCallback>(std::move(callback));
  answer(
      [weak = std::weak_ptr(watcher)](Result<Command> result) {
        if (const auto alive = weak.lock()) (*alive)(std::move(result));
      },
      result_of("feeder", CommandKind::home));
  const std::lock_guard lock(mutex_);
  watchers_.push_back(watcher);
  return watcher;
}

void FakeMachine::let_stops_wait(const std::string& client, std::size_t axes) {
  const std::lock_guard lock(mutex_);
  stops_waiting_[client] = axes;
}

std::size_t FakeMachine::stops_waiting(const std::string& client) const {
  const std::lock_guard lock(mutex_);
  const auto found = stops_waiting_.find(client);
  return found == stops_waiting_.end() ? 0 : found->second;
}

void FakeMachine::cancel_command(std::string id, std::string client, CommandCallback callback) {
  note(fmt::format("cancel_command {} by {}", id, client));
  answer(callback, result_of("feeder", CommandKind::home));
}

void FakeMachine::budgets(std::function<void(std::vector<BusBudgetReport>)> callback) {
  BusBudgetReport report;
  report.predicted = {
      .bus = "line-a",
      .load =
          {{.moving = 0, .utilisation = 0.25, .utilisation_max = 0.5, .refresh_idle = 300ms, .start = 80ms}},
      .stops = {{.axes = 1, .last_frame = 28ms, .standstill = 120ms}},
      .notes = {"a note"}};
  report.axes.push_back({.predicted = {.axis = "feeder", .refresh_moving_all = Duration::max()},
                         .deceleration = 150ms,
                         .unit = "mm",
                         .way_alone = 10.5,
                         .observed = {.stop_frame = 7ms}});
  report.excess.push_back({.key = "stop_bound", .text = "too late", .remedy = "raise it"});
  post([callback = std::move(callback), report] { callback({report}); });
}

void FakeMachine::buses(std::function<void(std::vector<BusStatus>)> callback) {
  BusStatus status{
      .name = "line-a", .port = "sim", .baud = 115200, .open = true, .simulated = true, .error = {}};
  status.counters.timeouts = 7;
  NetworkStatus network{.link = can::InterfaceState::bus_off,
                        .sync_period = 10ms,
                        .sync_running = true,
                        .emergencies = 3,
                        .foreign_nodes = {22, 23},
                        .link_helper_error = Error{.reason = Reason::bus_down,
                                                   .message = "no helper",
                                                   .remedy = "enable it",
                                                   .where = {.bus = "can0"}}};
  network.frames = {.received = 11, .sent = 12, .not_sent = 13, .unknown = 14, .error_frames = 15};
  network.frames.receive_overflows = 16;
  network.frames.no_buffer = 17;
  network.frames.bus_offs = 18;
  network.frames.stalls = 19;
  network.sdo = {.transfers = 21, .aborted_by_node = 22, .timeouts = 23, .protocol_errors = 24};
  network.sync = {.sent = 31, .missed = 32, .latest = 2ms};
  network.others = {.unknown_cob = 41, .foreign_node = 42, .malformed = 43};
  const BusStatus can{.name = "can0",
                      .kind = BusKind::canopen,
                      .port = "can0",
                      .baud = 500'000,
                      .error = Error{.reason = Reason::bus_down, .message = "bus-off"},
                      .network = network};
  post([callback = std::move(callback), status, can] { callback({status, can}); });
}

void FakeMachine::on_published(std::function<void()> notify) {
  const std::lock_guard lock(mutex_);
  notify_ = std::move(notify);
}

WallTime FakeMachine::wall(TimePoint t) const {
  return WallTime(1'700'000'000s) + std::chrono::duration_cast<WallTime::duration>(t.time_since_epoch());
}

}  // namespace axisd::testing
