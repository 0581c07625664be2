#include "daemon/core/machine_core.hpp"

#include <stdexcept>
#include <thread>
#include <vector>

#include "daemon/core/core_loop.hpp"
#include "daemon/core/machine_service.hpp"
#include "tests/unit/daemon/core/machine_rig.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;

/// Three axes on one line; the drive of the last one has no power.
class ThreeAxes : public MachineOnALine {
 protected:
  ThreeAxes() : MachineOnALine("three", {1, 2, 3}) {}
  void start() { start_with({1, 2, 3}, 3); }
};

TEST_F(ThreeAxes, OneDeadDriveDoesNotDelayTheOthers) {
  start();
  EXPECT_EQ(machine_->find("a1")->snapshot()->link, LinkState::online);
  EXPECT_EQ(machine_->find("a2")->snapshot()->link, LinkState::online);
  EXPECT_EQ(machine_->find("a3")->snapshot()->link, LinkState::offline);
  EXPECT_TRUE(machine_->at_rest());
  EXPECT_TRUE(machine_->buses_reported());
  line_->network().node(3)->set_power(true);
  world_.run_for(3s);
  EXPECT_EQ(machine_->find("a3")->snapshot()->link, LinkState::online);
}

TEST_F(ThreeAxes, UnknownAxes) {
  start();
  EXPECT_EQ(machine_->find("a4"), nullptr);
  EXPECT_EQ(machine_->submit("a4", StopRequest{}, {}).error().reason, Reason::unknown_axis);
}

TEST_F(ThreeAxes, StopAllStopsMovingAxesFirstAndSilentOnesLast) {
  start();
  const auto run = machine_->submit("a2", MoveVelocityRequest{.velocity = 50}, {});
  ASSERT_TRUE(run);
  world_.run_for(500ms);
  line_->forget_wire();
  const auto stops = machine_->stop_all("operator");
  ASSERT_EQ(stops.size(), 3U);
  world_.run_for(3s);
  std::vector<int> nodes;
  for (const auto& entry : line_->wire())
    if (entry.is_write() && entry.address() == 0x0028) nodes.push_back(entry.node());
  ASSERT_GE(nodes.size(), 3U);
  EXPECT_EQ(nodes[0], 2);
  EXPECT_EQ(nodes[1], 1);
  EXPECT_EQ(nodes[2], 3);
  EXPECT_EQ((*stops[0])->value().state, CommandState::done);
  EXPECT_EQ((*stops[1])->value().state, CommandState::done);
  EXPECT_EQ((*stops[2])->value().state, CommandState::unknown) << "nobody answered";
  EXPECT_EQ(*machine_->inhibited_by(), "operator");
  EXPECT_TRUE(store_.saved.inhibit.active);
}

/// It halts the axis, so it comes before whatever else waits for the core.
TEST_F(ThreeAxes, ACancelledCommandHaltsBeforeHandlersThatAreReady) {
  start();
  const auto run = machine_->submit("a1", MoveVelocityRequest{.velocity = 50}, {});
  ASSERT_TRUE(run);
  world_.run_for(500ms);
  CoreLoop loop;
  MachineService service(loop, *machine_, "three", "t");
  std::vector<CommandState> seen_by_ready;
  post(loop.executor(), [&] {
    post(loop.executor(), [&] { seen_by_ready.push_back((*run)->value().state); });
    std::thread([&] {
      service.cancel_command((*run)->value().id, "c", [](const Result<Command>&) {});
    }).join();
    post(loop.executor(), [&] { loop.stop(); });
  });
  loop.run();
  EXPECT_EQ(seen_by_ready, std::vector{CommandState::aborted});
  world_.run_for(2s);
  EXPECT_FALSE(line_->network().node(1)->shaft_moving());
}

TEST_F(ThreeAxes, AFullDiskDoesNotDelayStopAll) {
  start();
  ASSERT_TRUE(machine_->submit("a1", MoveVelocityRequest{.velocity = 50}, {}));
  world_.run_for(500ms);
  store_.failing = true;
  machine_->stop_all("operator");
  EXPECT_NE(machine_->inhibited_by(), nullptr);
  world_.run_for(1s);
  EXPECT_FALSE(line_->network().node(1)->shaft_moving());
}

TEST_F(ThreeAxes, TheEndOfTheDaemonStopsWhatMovesOnly) {
  start();
  ASSERT_TRUE(machine_->submit("a1", MoveVelocityRequest{.velocity = 50}, {}));
  world_.run_for(500ms);
  EXPECT_FALSE(machine_->at_rest());
  line_->forget_wire();
  EXPECT_EQ(machine_->stop_moving_axes(), std::vector<std::string>{"a1"});
  EXPECT_TRUE(world_.run_until([this] { return machine_->at_rest(); }, 3s));
  EXPECT_FALSE(line_->network().node(1)->shaft_moving());
  for (const auto& entry : line_->wire())
    if (entry.is_write()) EXPECT_EQ(entry.node(), 1);
}

TEST_F(ThreeAxes, ALatchedInhibitIsFoundAtTheStart) {
  store_.saved.inhibit = {.active = true, .by = "last week"};
  store_.restart();
  start();
  EXPECT_EQ(machine_->submit("a1", MoveRelativeRequest{.distance = 1}, {}).error().reason, Reason::inhibited);
  EXPECT_EQ(*machine_->inhibited_by(), "last week");
}

TEST_F(ThreeAxes, AConfigurationThatTheLoaderWouldRefuseIsNotBuilt) {
  configuration_.axes[1].axis.scale.pulses_per_revolution = 1000;
  configuration_.axes[1].axis.bus = "line-b";
  EXPECT_THROW(start(), std::invalid_argument);
  machine_.reset();
}

}  // namespace
}  // namespace axisd::core
