// The daemon without gRPC, in real time: plain threads play the gRPC side against the real core thread, bus
// worker, store and simulated line. ThreadSanitizer sees everything in it. Nothing here asserts how long
// something takes.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <future>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "buses/modbus_rtu/rtu_worker.hpp"
#include "config/fields.hpp"
#include "daemon/core/core_loop.hpp"
#include "daemon/core/machine_core.hpp"
#include "daemon/core/machine_service.hpp"
#include "daemon/store/kept_state.hpp"
#include "devices/simulation/pty_line.hpp"
#include "devices/simulation/simulator.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr int axis_count = 3;

config::Configuration three_axes() {
  config::Configuration configuration{.machine = "rig"};
  configuration.lines.push_back({.name = "line-a", .port = "sim"});
  for (int i = 1; i <= axis_count; ++i) {
    AxisSettings axis{.name = "axis-" + std::to_string(i),
                      .bus = "line-a",
                      .node = static_cast<std::uint8_t>(i),
                      .model = "ykd2405pr"};
    axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .unit = "mm"};
    axis.limits.velocity = 200;
    axis.turnaround_max = 1s;  // the simulated line's thread may wait long for its turn
    configuration.axes.push_back({.axis = axis});
  }
  return configuration;
}

class RealRig : public testing::Test {
 protected:
  template <class Function>
  auto on_core(Function function) {
    std::packaged_task<decltype(function())()> task(std::move(function));
    auto result = task.get_future();
    post(loop_.executor(), [&task] { task(); });
    return result.get();
  }

  void SetUp() override {
    directory_ =
        std::filesystem::temp_directory_path() / ("axisd-rig-" + std::to_string(std::random_device{}()));
    std::vector<std::unique_ptr<simulation::SimulatedRtuNode>> nodes;
    for (std::uint8_t i = 1; i <= axis_count; ++i)
      nodes.push_back(simulation::find_simulator("ykd2405pr")->make({.address = i}));
    auto line = simulation::PtyLine::open({}, std::move(nodes));
    ASSERT_TRUE(line) << to_string(line.error());
    line_ = std::move(*line);
    auto store = store::KeptState::open(directory_, std::chrono::system_clock::now(), loop_.executor());
    ASSERT_TRUE(store) << to_string(store.error());
    store_ = std::move(*store);
    machine_ = std::make_unique<core::MachineCore>(
        core::MachineParts{.executor = loop_.executor(),
                           .clock = &loop_.clock(),
                           .persistence = &store_->state(),
                           .instance_id = "rig",
                           .make_line =
                               [this](const modbus_rtu::LineSettings& settings) {
                                 return std::make_unique<modbus_rtu::RtuWorker>(
                                     loop_.executor(), settings,
                                     [this]() -> Result<std::string> { return line_->path(); });
                               },
                           .published = [this] { publications_.fetch_add(1, std::memory_order_relaxed); }},
        three_axes());
    service_ = std::make_unique<core::MachineService>(loop_, *machine_, "rig", "rig");
    machine_->start();
    core_ = std::thread([this] { loop_.run(); });
  }

  void TearDown() override {
    service_->close();
    on_core([this] { machine_->close(); });
    while (!on_core([this] { return machine_->closed(); })) pause();
    loop_.stop();
    core_.join();
    machine_.reset();
    store_.reset();
    std::filesystem::remove_all(directory_);
  }

  /// Lets the other threads work; conditions are polled at this pace.
  static void pause() { block_until(monotonic_now() + 5ms); }

  Result<Command> submit(const std::string& axis, Action action, WaitUntil until = WaitUntil::done) {
    auto promise = std::make_shared<std::promise<Result<Command>>>();
    auto result = promise->get_future();
    service_->submit(axis, std::move(action),
                     {.client = "rig", .request_id = std::to_string(next_request_.fetch_add(1))}, until,
                     [promise](Result<Command> command) { promise->set_value(std::move(command)); });
    return result.get();
  }

  void wait_online() {
    for (const auto& axis : service_->axis_names())
      while (service_->snapshot(axis)->link != LinkState::online) pause();
  }

  std::filesystem::path directory_;
  std::unique_ptr<simulation::PtyLine> line_;
  core::CoreLoop loop_;
  std::unique_ptr<store::KeptState> store_;
  std::unique_ptr<core::MachineCore> machine_;
  std::unique_ptr<core::MachineService> service_;
  std::thread core_;
  std::atomic<int> publications_{0};
  std::atomic<int> next_request_{0};
};

TEST_F(RealRig, MovesAxesFromManyThreads) {
  wait_online();
  std::vector<std::thread> clients;
  std::atomic<bool> reading{true};
  std::thread reader([&] {
    while (reading) {
      for (const auto& axis : service_->axis_names()) EXPECT_FALSE(service_->snapshot(axis)->name.empty());
      (void)service_->info();
      pause();
    }
  });
  for (const auto& axis : service_->axis_names())
    clients.emplace_back([this, axis] {
      EXPECT_EQ(submit(axis, EnableRequest{})->state, CommandState::done);
      EXPECT_EQ(submit(axis, SetPositionRequest{.position = 0})->state, CommandState::done);
      for (int i = 1; i <= 3; ++i) {
        const auto moved = submit(axis, MoveAbsoluteRequest{.position = 10.0 * i});
        ASSERT_TRUE(moved) << to_string(moved.error());
        EXPECT_EQ(moved->state, CommandState::done) << (moved->cause ? to_string(*moved->cause) : "");
      }
      EXPECT_DOUBLE_EQ(service_->snapshot(axis)->position, 30);
    });
  for (auto& client : clients) client.join();
  reading = false;
  reader.join();
  EXPECT_GT(publications_.load(), 0);
  const auto starts = line_->with_network([](simulation::RtuNetwork& network) {
    int total = 0;
    for (const auto& node : network.nodes()) total += node->starts();
    return total;
  });
  EXPECT_EQ(starts, 3 * axis_count);
}

TEST_F(RealRig, StopsFromOtherThreadsWinOverMoves) {
  wait_online();
  for (const auto& axis : service_->axis_names()) {
    ASSERT_EQ(submit(axis, EnableRequest{})->state, CommandState::done);
    ASSERT_EQ(submit(axis, SetPositionRequest{.position = 0})->state, CommandState::done);
  }
  std::vector<std::thread> clients;
  for (const auto& axis : service_->axis_names()) {
    clients.emplace_back([this, axis] {
      for (int i = 0; i < 6; ++i) {
        const auto moved =
            submit(axis, MoveAbsoluteRequest{.position = i % 2 == 0 ? 300.0 : 0.0}, WaitUntil::done);
        // Refused while stopping, aborted by a stop, or done: never anything else.
        if (moved)
          EXPECT_TRUE(moved->state == CommandState::aborted || moved->state == CommandState::done)
              << (moved->cause ? to_string(*moved->cause) : "");
      }
    });
    clients.emplace_back([this, axis] {
      for (int i = 0; i < 10; ++i) {
        const auto stopped = submit(axis, StopRequest{}, WaitUntil::done);
        ASSERT_TRUE(stopped) << to_string(stopped.error());
        EXPECT_EQ(stopped->state, CommandState::done);
        for (int pauses = 0; pauses < 10; ++pauses) pause();
      }
    });
  }
  for (auto& client : clients) client.join();
}

TEST_F(RealRig, StopAllInhibitsUntilReleased) {
  wait_online();
  ASSERT_EQ(submit("axis-1", EnableRequest{})->state, CommandState::done);
  ASSERT_TRUE(submit("axis-1", MoveVelocityRequest{.velocity = 50}, WaitUntil::started));
  std::promise<AllStopped> stopped;
  service_->stop_all({.client = "rig"}, WaitUntil::done,
                     [&](AllStopped all) { stopped.set_value(std::move(all)); });
  const auto answer = stopped.get_future().get();
  for (const auto& result : answer.stops) {
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_EQ(result->state, CommandState::done);
  }
  EXPECT_TRUE(service_->info().inhibited);
  const auto refused = submit("axis-1", MoveVelocityRequest{.velocity = 50}, WaitUntil::accepted);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::inhibited);
  std::promise<Result<void>> released;
  service_->release_inhibit("rig", [&](Result<void> result) { released.set_value(std::move(result)); });
  EXPECT_TRUE(released.get_future().get());
  EXPECT_FALSE(service_->info().inhibited);
}

TEST_F(RealRig, ComesBackAfterTheAdapterWasUnplugged) {
  wait_online();
  line_->hang_up();
  while (service_->snapshot("axis-1")->link == LinkState::online) pause();
  ASSERT_TRUE(line_->replug());
  wait_online();
  EXPECT_EQ(submit("axis-1", EnableRequest{})->state, CommandState::done);
}

/// Whoever reads, watches or stops meanwhile never meets an axis that is being destroyed.
TEST_F(RealRig, AxesAreExchangedUnderReadersAndStops) {
  wait_online();
  std::atomic<bool> going{true};
  const auto released = submit("axis-3", DisableRequest{});
  ASSERT_TRUE(released && released->state == CommandState::done) << "an energised axis may not go";
  std::vector<std::thread> others;
  others.emplace_back([&] {
    while (going) {
      for (const auto& axis : service_->axis_names())
        if (const auto state = service_->snapshot(axis)) EXPECT_EQ(state->name, axis);
      (void)service_->group_access().groups();
      (void)service_->bus_access().devices();
    }
  });
  others.emplace_back([&] {
    while (going) {
      const auto stopped = submit("axis-3", StopRequest{});
      if (stopped)
        EXPECT_EQ(stopped->state, CommandState::done) << (stopped->cause ? to_string(*stopped->cause) : "");
      else
        EXPECT_EQ(stopped.error().reason, Reason::unknown_axis);
      for (int pauses = 0; pauses < 20; ++pauses) pause();
    }
  });
  others.emplace_back([&] {
    while (going) {
      std::promise<void> answered;
      service_->group_access().stop({.axes = {"axis-2", "axis-3"}}, "rig", WaitUntil::done,
                                    [&](const auto&) { answered.set_value(); });
      answered.get_future().get();
      for (int pauses = 0; pauses < 20; ++pauses) pause();
    }
  });
  auto present = three_axes();
  int applied = 0;
  for (int i = 0; applied < 15; ++i) {  // in between they rest
    auto wanted = three_axes();
    if (i % 3 == 1) wanted.axes.pop_back();
    if (i % 3 == 2) wanted.groups.push_back({.name = "both", .axes = {"axis-1", "axis-2"}});
    for (auto& entry : wanted.axes) entry.axis.limits.velocity = 100 + i % 50;
    std::promise<std::vector<Error>> answer;
    service_->reload(
        {.client = "rig", .configuration = wanted, .changes = config::differences(present, wanted)}, false,
        [&](std::vector<Error> refusals) { answer.set_value(std::move(refusals)); });
    const auto refusals = answer.get_future().get();
    for (const auto& refusal : refusals) EXPECT_EQ(refusal.reason, Reason::stopping) << to_string(refusal);
    if (refusals.empty()) present = wanted;
    applied += refusals.empty() ? 1 : 0;
    pause();
  }
  going = false;
  for (auto& other : others) other.join();
  wait_online();
  EXPECT_EQ(service_->axis_names().size(), present.axes.size());
}

}  // namespace
}  // namespace axisd::test
