#include "daemon/core/link_cycler.hpp"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "buses/can/network.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using can::Controller;
using can::InterfaceState;

/// A machine with one CAN network, and somebody who is asked for cycles of its link.
class Links : public testing::Test {
 protected:
  enum class Helper { cycles, refuses, silent };
  using LinkDone = std::function<void(Result<void>)>;

  explicit Links(bool with_axis = false) {
    configuration_.machine = "m";
    configuration_.networks.push_back({.name = "cell", .interface = "can7", .bitrate = 1'000'000});
    if (with_axis) {
      AxisSettings axis{.name = "table", .bus = "cell", .node = 5, .model = "yss-c"};
      axis.scale = {.pulses_per_revolution = 4000, .travel_numerator = 360, .unit = "deg"};
      axis.limits.velocity = 3600;
      configuration_.axes.push_back({.axis = axis});
    }
    machine_ = std::make_unique<MachineCore>(
        MachineParts{
            .executor = world_.executor(),
            .clock = &world_.clock(),
            .instance_id = "t",
            .make_port =
                [this](const canopen::NetworkSettings& settings) {
                  can::PortSettings port{.bus = settings.name, .interface = settings.interface};
                  auto made = std::make_unique<can::NetworkPort>(world_.clock(), port, network_);
                  port_ = made.get();
                  return made;
                },
            .link_helper = {.cycle = [this](const std::string& interface,
                                            LinkDone done) { asked(interface, std::move(done)); },
                            .check = [this](const std::string& interface,
                                            LinkDone done) { checked(interface, std::move(done)); }}},
        configuration_);
    machine_->start();
    world_.run_for(10ms);
  }
  ~Links() override {
    machine_->close();
    // At once: also while an answer is owed.
    EXPECT_TRUE(world_.run_until([this] { return machine_->closed(); }, 0ms));
  }

  void asked(const std::string& interface, std::function<void(Result<void>)> done) {
    EXPECT_EQ(interface, "can7");
    asked_at_.push_back(std::chrono::duration_cast<milliseconds>(world_.now() - broken_at_).count());
    if (helper_ == Helper::silent) return;
    post(world_.executor(), [this, done = std::move(done)] {
      if (helper_ == Helper::refuses)
        return done(fail(Reason::misconfigured, "can7 is not among the links", "add it"));
      port_->cycle();
      done({});
    });
  }
  void checked(const std::string& interface, LinkDone done) {
    EXPECT_EQ(interface, "can7");
    ++checks_;
    if (helper_ == Helper::silent) return;
    post(world_.executor(), [this, done = std::move(done)] {
      if (helper_ == Helper::refuses)
        return done(fail(Reason::misconfigured, "can7 is not among the links", "add it"));
      done({});
    });
  }
  /// What the API tells of the helper; empty: nothing.
  [[nodiscard]] std::string told() const {
    const auto error = machine_->bus_status().at(0).network->link_helper_error;
    return error ? error->where.bus + ": " + error->message : "";
  }
  void go_bus_off() {
    broken_at_ = world_.now();
    asked_at_.clear();
    port_->report(Controller::bus_off);
  }
  [[nodiscard]] InterfaceState link() const { return port_->state().link; }

  test::VirtualWorld world_;
  can::Network network_{world_.clock(), 1'000'000};
  config::Configuration configuration_;
  can::NetworkPort* port_ = nullptr;
  std::unique_ptr<MachineCore> machine_;
  Helper helper_ = Helper::cycles;
  TimePoint broken_at_{};
  std::vector<long> asked_at_;  ///< ms since go_bus_off()
  int checks_ = 0;
};

using Times = std::vector<long>;

TEST_F(Links, ThatNobodyWouldCycleIsToldAsLongAsItIsSo) {
  EXPECT_EQ(checks_, 1);
  EXPECT_EQ(told(), "");
  helper_ = Helper::refuses;
  world_.run_for(LinkCycler::check_period);
  EXPECT_EQ(told(), "cell: can7 is not among the links");
  go_bus_off();
  world_.run_for(10ms);
  EXPECT_EQ(told(), "cell: can7 is not among the links");
  port_->cycle();  // by hand, which does not change who could
  world_.run_for(1s);
  EXPECT_EQ(told(), "cell: can7 is not among the links");
  helper_ = Helper::cycles;
  world_.run_for(LinkCycler::check_period);
  EXPECT_EQ(told(), "");
  EXPECT_EQ(machine_->bus_status().at(0).network->link, InterfaceState::up);
}

TEST_F(Links, WhatIsWrongWithALinkIsLoggedWhenItChanges) {
  std::ostringstream log;
  const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(log);
  auto& sinks = spdlog::default_logger()->sinks();
  sinks.push_back(sink);
  for (int i = 0; i < 2; ++i) {
    port_->set_up(false);
    world_.run_for(1min);
    port_->set_up(true);
    world_.run_for(1min);
  }
  std::erase(sinks, sink);
  const auto count = [text = log.str()](std::string_view part) {
    int found = 0;
    for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("cell: CAN interface can7 is down"), 2) << log.str();
  EXPECT_EQ(count("cell: CAN interface can7 is up"), 2) << log.str();
}

TEST_F(Links, BusOffDoesNotWaitForTheAnswerOfACheck) {
  helper_ = Helper::silent;
  world_.run_for(LinkCycler::check_period);
  EXPECT_EQ(checks_, 2);
  helper_ = Helper::cycles;
  go_bus_off();
  world_.run_for(200ms);
  EXPECT_EQ(asked_at_, Times{0});
  EXPECT_EQ(link(), InterfaceState::up);
}

TEST_F(Links, ASoundLinkIsLeftAlone) {
  world_.run_for(1min);
  port_->set_up(false);  // somebody's will
  world_.run_for(1min);
  EXPECT_TRUE(asked_at_.empty());
}

TEST_F(Links, BusOffIsCycledAtOnce) {
  go_bus_off();
  world_.run_for(200ms);
  EXPECT_EQ(asked_at_, Times{0});
  EXPECT_EQ(link(), InterfaceState::up);
  EXPECT_TRUE(machine_->find_bus("cell")->port().open);
}

TEST_F(Links, AStallIsCycledAndNothingOfBeforeIsSent) {
  std::vector<can::Frame> received;
  network_.join([&](const can::Frame& frame, TimePoint, bool) { received.push_back(frame); });
  network_.set_stalled(true);
  broken_at_ = world_.now();
  std::vector<can::SendStatus> endings;
  port_->send(can::make_frame(0x205, {}), {},
              [&](const can::SendResult& result) { endings.push_back(result.status); });
  world_.run_for(200ms);
  EXPECT_EQ(asked_at_, Times{100});  // the stall's own time-out
  EXPECT_EQ(endings, std::vector{can::SendStatus::unknown});
  network_.set_stalled(false);
  world_.run_for(1s);
  EXPECT_TRUE(received.empty());
  EXPECT_EQ(link(), InterfaceState::up);
}

TEST_F(Links, WhoeverRefusesIsAskedAgainLessAndLess) {
  helper_ = Helper::refuses;
  go_bus_off();
  world_.run_for(30s);
  EXPECT_EQ(asked_at_, (Times{0, 100, 300, 700, 1500, 3100, 6300, 12700, 22700}));
  helper_ = Helper::cycles;
  world_.run_for(10s);
  EXPECT_EQ(link(), InterfaceState::up);
}

TEST_F(Links, ALinkThatBreaksAgainAtOnceIsGivenTimeAndOneThatWasSoundIsNot) {
  for (int i = 0; i < 4; ++i) {
    port_->report(Controller::bus_off);
    world_.run_for(10ms);
  }
  // The causes came 10 ms apart, and only the first was served at once.
  EXPECT_EQ(link(), InterfaceState::bus_off);
  world_.run_for(1s);
  EXPECT_EQ(link(), InterfaceState::up);
  world_.run_for(LinkCycler::sound_after);
  go_bus_off();
  world_.run_for(50ms);
  EXPECT_EQ(asked_at_, Times{0});
  EXPECT_EQ(link(), InterfaceState::up);
}

TEST_F(Links, TheMachineClosesWhileAnAnswerIsOwed) {
  helper_ = Helper::silent;
  go_bus_off();
  world_.run_for(1min);
  EXPECT_EQ(asked_at_, Times{0});  // one request at a time: whoever asks ends it in its own time
}

/// The same with a drive, which moves.
class MovingDrive : public Links {
 protected:
  MovingDrive() : Links(true) {
    drives_.nodes().add(std::move(*simulation::make_can_node("yss-c", {.address = 5})));
    EXPECT_TRUE(world_.run_until([this] { return state()->link == axisd::LinkState::online; }, 10s));
    EXPECT_TRUE(machine_->submit("table", EnableRequest{}, {}));
    world_.run_for(1s);
    EXPECT_TRUE(machine_->submit("table", MoveVelocityRequest{.velocity = 360}, {}));
    world_.run_for(1s);
    EXPECT_TRUE(drives_.nodes().node(5)->shaft_moving());
  }
  [[nodiscard]] AxisSnapshotPtr state() const { return machine_->find("table")->snapshot(); }

  simulation::NetworkNodes drives_{world_.clock(), network_};
};

TEST_F(MovingDrive, IsStoppedAfterAnOutageThatIsOverBeforeAnybodyPolls) {
  const auto starts = drives_.nodes().node(5)->starts();
  std::optional<Duration> halted;  // since the bus-off: bit 8 of the control word, by PDO or SDO
  network_.join([&](const can::Frame& frame, TimePoint at, bool) {
    const bool by_pdo = frame.id == 0x205 && (frame.data[1] & 1U) != 0;
    const bool by_sdo = frame.id == 0x605 && frame.data[1] == 0x40 && frame.data[2] == 0x60 &&
                        frame.data[0] == 0x2B && (frame.data[5] & 1U) != 0;
    if (!halted && (by_pdo || by_sdo)) halted = at - broken_at_;
  });
  go_bus_off();
  world_.run_for(200ms);
  EXPECT_EQ(asked_at_, Times{0});
  // M26: 200 ms for the cycle (this helper takes none), and what the bus takes.
  ASSERT_TRUE(halted);
  EXPECT_LT(*halted, 20ms);  // a transfer that was under way is cut after 10 ms
  world_.run_for(3s);
  EXPECT_FALSE(drives_.nodes().node(5)->shaft_moving());
  EXPECT_EQ(drives_.nodes().node(5)->starts(), starts);
  EXPECT_EQ(state()->state, AxisState::error_stop);
  EXPECT_EQ(state()->link, axisd::LinkState::online);
}

TEST_F(MovingDrive, IsStoppedWhenTheLinkWasDownForAMoment) {
  port_->cycle();  // by hand: nobody sees it down
  world_.run_for(3s);
  EXPECT_FALSE(drives_.nodes().node(5)->shaft_moving());
  EXPECT_EQ(state()->state, AxisState::error_stop);
}

TEST(LinkCycler, SaysWhyALinkIsNotCycled) {
  test::VirtualWorld world;
  can::Network network(world.clock(), 1'000'000);
  auto port = std::make_unique<can::NetworkPort>(
      world.clock(), can::PortSettings{.bus = "cell", .interface = "can7"}, network);
  auto* const link = port.get();
  canopen::CanopenBus bus(world.executor(), world.clock(), {.name = "cell", .interface = "can7"},
                          std::move(port));
  LinkCycler cycler(world.executor(), world.clock(), bus, {});
  bus.start();
  spawn(world.executor(), cycler.run(), "cycler");
  world.run_for(1s);
  EXPECT_FALSE(cycler.trouble());
  link->report(Controller::bus_off);
  world.run_for(1s);
  ASSERT_TRUE(cycler.trouble());
  EXPECT_EQ(cycler.trouble()->reason, Reason::not_supported);
  EXPECT_EQ(cycler.trouble()->where.bus, "cell");
  EXPECT_FALSE(cycler.trouble()->remedy.empty());
  link->cycle();  // by hand
  world.run_for(20s);
  EXPECT_FALSE(cycler.trouble());
  cycler.close();
  bus.close();
  world.run_for(1ms);
}

TEST(LinkCycler, ASimulatedLinkNeedsNoHelper) {
  test::VirtualWorld world;
  can::Network network(world.clock(), 1'000'000);
  auto port = std::make_unique<can::NetworkPort>(
      world.clock(), can::PortSettings{.bus = "cell", .interface = "sim"}, network);
  auto* const link = port.get();
  canopen::CanopenBus bus(world.executor(), world.clock(), {.name = "cell", .interface = "sim"},
                          std::move(port));
  LinkCycler cycler(world.executor(), world.clock(), bus, {});
  bus.start();
  spawn(world.executor(), cycler.run(), "cycler");
  world.run_for(1s);
  link->report(Controller::bus_off);
  EXPECT_EQ(bus.link().error->remedy.find("ip link"), std::string::npos);
  world.run_for(1ms);
  EXPECT_EQ(bus.link().link, InterfaceState::up);
  network.set_stalled(true);
  link->send(can::make_frame(0x123, {}), {}, {});
  world.run_for(99ms);
  EXPECT_EQ(link->counters().stalls, 0U);
  world.run_for(1s);
  EXPECT_EQ(link->counters().stalls, 1U);
  network.set_stalled(false);
  world.run_for(LinkCycler::longest_pause);
  EXPECT_EQ(bus.link().link, InterfaceState::up);
  EXPECT_FALSE(cycler.trouble());
  cycler.close();
  bus.close();
  world.run_for(1ms);
}

}  // namespace
}  // namespace axisd::core
