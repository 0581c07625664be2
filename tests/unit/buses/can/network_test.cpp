#include "buses/can/network.hpp"

#include <gtest/gtest.h>

#include "tests/support/virtual_world.hpp"
#include "tests/unit/buses/can/frames.hpp"

namespace axisd::can {
namespace {

using namespace std::chrono_literals;
using test::frame_of;
using test::guarded_by;
using test::options_of;
using Class = TransactionClass;
using Texts = std::vector<std::string>;

template <typename Port>
struct BenchOf {
  axisd::test::VirtualWorld world;
  Network network{world.clock(), 1'000'000};
  Port port{world.clock(), {.bus = "cell", .interface = "sim", .stall_timeout = 100ms}, network};
  test::Endings endings;
  Texts received;  ///< by the port
  std::vector<InterfaceState> states;
  Texts others;  ///< received by another node
  std::vector<TimePoint> at;
  Network::Id node = network.join([this](const Frame& frame, TimePoint when, bool own) {
    if (own) return;
    others.push_back(to_string(frame));
    at.push_back(when);
  });

  BenchOf() {
    port.start({.on_frame = [this](const ReceivedFrame& each) { received.push_back(to_string(each.frame)); },
                .on_state = [this](const PortState& state) { states.push_back(state.link); }});
    world.run_for(1ms);
  }
  void send(std::uint32_t id, const SendOptions& options = options_of(Class::motion)) {
    port.send(frame_of(id), options, endings.of(id));
  }
};
using Bench = BenchOf<NetworkPort>;
using States = std::vector<InterfaceState>;

/// As an interface with IFF_ECHO: what is in a mailbox of the controller is in no memory of the kernel.
struct WithMailboxes : NetworkPort {
  using NetworkPort::NetworkPort;
  bool drained() override { return true; }
  bool empty_below() override { return false; }
};

TEST(CanNetwork, CarriesFramesInTheTimeTheyTake) {
  Bench bench;
  EXPECT_EQ(bench.states, States{InterfaceState::up});
  const auto begin = bench.world.now();
  bench.send(0x123);
  EXPECT_TRUE(bench.endings.texts().empty());  // never from within send()
  bench.world.run_for(1ms);
  EXPECT_EQ(bench.others, Texts{"123#"});
  EXPECT_EQ(bench.at.at(0), begin + 55us);
  ASSERT_EQ(bench.endings.texts(), Texts{"291:sent"});
  EXPECT_EQ(bench.endings.results().at(0).handed_over, begin);
  EXPECT_EQ(bench.endings.results().at(0).sent_at, begin + 55us);
  EXPECT_TRUE(bench.received.empty());  // own frames are no received ones
}

TEST(CanNetwork, TheLowestIdGoesFirstButNoneIsInterrupted) {
  Bench bench;
  bench.send(0x300);
  bench.send(0x100);
  bench.network.transmit(bench.node, frame_of(0x200));
  Texts all;
  bench.network.join([&](const Frame& frame, TimePoint, bool) { all.push_back(to_string(frame)); });
  bench.world.run_for(1ms);
  EXPECT_EQ(all, (Texts{"300#", "100#", "200#"}));
  EXPECT_EQ(bench.received, Texts{"200#"});
}

TEST(CanNetwork, ArbitrationKnowsRemoteAndExtendedFrames) {
  Bench bench;
  Texts all;
  bench.network.join([&](const Frame& frame, TimePoint, bool) { all.push_back(to_string(frame)); });
  const auto transmit = [&](const Frame& frame) {
    const auto id = bench.network.join([](const Frame&, TimePoint, bool) {});
    bench.network.transmit(id, frame);
  };
  transmit(frame_of(0x000));  // takes the idle wire
  transmit({.id = 0x100U << 18U, .extended = true});
  transmit({.id = 0x100, .rtr = true});
  transmit(frame_of(0x101));
  transmit(frame_of(0x100));
  bench.world.run_for(10ms);
  EXPECT_EQ(all, (Texts{"000#", "100#", "100#R", "04000000#", "101#"}));
}

TEST(CanNetwork, DropsAndDelaysAsToldAndConfirmsAllTheSame) {
  Bench bench;
  bench.network.set_fault([](const Frame& frame) {
    return Network::Fault{.drop = frame.id == 1, .delay = frame.id == 2 ? 5ms : 0ms};
  });
  for (const auto id : {1U, 2U, 3U}) bench.send(id);
  bench.world.run_for(4ms);
  EXPECT_EQ(bench.others, Texts{"003#"});
  EXPECT_EQ(bench.endings.texts(), (Texts{"1:sent", "2:sent", "3:sent"}));
  bench.world.run_for(4ms);
  EXPECT_EQ(bench.others, (Texts{"003#", "002#"}));
}

TEST(CanPort, AStopOvertakesWhatIsQueuedAndMotionBehindItIsSuperseded) {
  Bench bench;
  const auto gate = std::make_shared<AxisGate>();
  for (std::uint32_t id = 1; id <= 8; ++id) bench.send(id, guarded_by(gate));
  gate->raise();
  bench.port.purge_superseded(*gate);
  bench.send(9, options_of(Class::stop));
  bench.world.run_for(10ms);
  EXPECT_EQ(bench.others, (Texts{"001#", "002#", "003#", "004#", "009#"}));
  EXPECT_EQ(bench.endings.texts().size(), 9U);
  EXPECT_EQ(bench.port.counters().sent, 5U);
  EXPECT_EQ(bench.port.counters().not_sent, 4U);
}

TEST(CanPort, InAStallAllEndsAndNothingIsSentLater) {
  Bench bench;
  bench.network.set_stalled(true);
  for (std::uint32_t id = 1; id <= 6; ++id) bench.send(id);
  bench.world.run_for(99ms);
  EXPECT_TRUE(bench.endings.texts().empty());
  bench.world.run_for(2ms);
  EXPECT_EQ(bench.endings.texts(),
            (Texts{"1:unknown", "2:unknown", "3:unknown", "4:unknown", "5:port_down", "6:port_down"}));
  EXPECT_EQ(bench.states, (States{InterfaceState::up, InterfaceState::stalled}));
  bench.send(7, options_of(Class::stop));
  bench.world.run_for(1ms);
  EXPECT_EQ(bench.endings.texts().back(), "7:port_down");

  bench.port.cycle();
  bench.network.set_stalled(false);
  bench.world.run_for(100ms);
  EXPECT_TRUE(bench.others.empty());
  EXPECT_EQ(bench.states,
            (States{InterfaceState::up, InterfaceState::stalled, InterfaceState::down, InterfaceState::up}));
  bench.send(8);
  bench.world.run_for(1ms);
  EXPECT_EQ(bench.others, Texts{"008#"});
  EXPECT_EQ(bench.port.counters().stalls, 1U);
}

TEST(CanPort, AFrameThatVanishesEndsAsUnknownAndTheRestGoesOn) {
  Bench bench;
  bench.network.set_fault(
      [](const Frame& frame) { return Network::Fault{.drop = frame.id == 1, .unconfirmed = frame.id == 1}; });
  bench.send(1);
  for (std::uint32_t id = 2; id < 22; ++id) {
    bench.send(id);
    bench.world.run_for(10ms);
  }
  EXPECT_EQ(std::ranges::count(bench.endings.texts(), "1:unknown"), 1);
  EXPECT_EQ(bench.endings.texts().size(), 21U);
  EXPECT_EQ(bench.others.size(), 20U);
  EXPECT_EQ(bench.states, States{InterfaceState::up}) << "no stall";
}

/// Nobody acknowledges it: it would move a shaft as soon as somebody does (M26).
TEST(CanPort, AFrameInAMailboxIsNotGivenUpButFlushed) {
  BenchOf<WithMailboxes> bench;
  bench.network.set_stalled(true);
  bench.send(1);
  bench.world.run_for(101ms);
  EXPECT_EQ(bench.endings.texts(), Texts{"1:unknown"});
  EXPECT_EQ(bench.states, (States{InterfaceState::up, InterfaceState::stalled}));
  bench.port.cycle();
  bench.network.set_stalled(false);
  bench.world.run_for(100ms);
  EXPECT_TRUE(bench.others.empty());
}

/// Whether its echo was lost, or others overtake it, nobody can tell there.
TEST(CanPort, AFrameThatMayBeInAMailboxIsAStallThoughOthersComeBack) {
  BenchOf<WithMailboxes> bench;
  bench.network.set_fault([](const Frame& frame) { return Network::Fault{.unconfirmed = frame.id == 1}; });
  bench.send(1);
  for (std::uint32_t id = 2; id < 21; ++id) {
    bench.send(id, options_of(Class::stop));
    bench.world.run_for(10ms);
  }
  EXPECT_EQ(std::ranges::count(bench.endings.texts(), "1:unknown"), 0);
  EXPECT_EQ(bench.states, States{InterfaceState::up});
  bench.world.run_for(11ms);
  EXPECT_EQ(std::ranges::count(bench.endings.texts(), "1:unknown"), 1);
  EXPECT_EQ(bench.states, (States{InterfaceState::up, InterfaceState::stalled}));
}

/// As `ip link set can0 up` on a link that is up.
TEST(CanPort, ToSetItUpTwiceLosesNothing) {
  Bench bench;
  for (std::uint32_t id = 1; id <= 3; ++id) bench.send(id);
  bench.port.set_up(true);
  bench.world.run_for(10ms);
  EXPECT_EQ(bench.endings.texts(), (Texts{"1:sent", "2:sent", "3:sent"}));
  bench.port.report(Controller::bus_off);
  bench.port.set_up(true);
  bench.world.run_for(10ms);
  EXPECT_EQ(bench.states.back(), InterfaceState::bus_off) << "it has to go down first";
}

TEST(CanNetwork, ALateHostMakesTheWireNoSlower) {
  Bench bench;
  const auto begin = bench.world.now();
  for (const auto id : {0x100U, 0x101U}) bench.network.transmit(bench.node, frame_of(id));
  bench.send(0x300);
  bench.send(0x301);
  bench.world.clock().advance_to(begin + 250ms);  // the process was not run meanwhile
  bench.world.run_for(0ms);
  EXPECT_EQ(bench.others, (Texts{"300#", "301#"}));
  EXPECT_EQ(bench.at, (std::vector{begin + 165us, begin + 220us}));
  EXPECT_EQ(bench.endings.texts(), (Texts{"768:sent", "769:sent"}));
  EXPECT_EQ(bench.endings.results().at(1).sent_at, begin + 220us);
}

TEST(CanNetwork, AFrameThatIsReadyLaterLeavesTheWireToOthers) {
  Bench bench;
  const auto begin = bench.world.now();
  Texts all;
  std::vector<TimePoint> at;
  bench.network.join([&](const Frame& frame, TimePoint when, bool) {
    all.push_back(to_string(frame));
    at.push_back(when);
  });
  bench.network.transmit(bench.node, frame_of(0x100), begin + 1ms);
  bench.send(0x300);
  bench.world.run_for(2ms);
  EXPECT_EQ(all, (Texts{"300#", "100#"}));
  EXPECT_EQ(at, (std::vector{begin + 55us, begin + 1ms + 55us}));
}

TEST(CanPort, ALateHostIsNoStall) {
  Bench bench;
  for (int turn = 0; turn < 20; ++turn) {
    // The node's frame is on the wire, ours waits for it, and the process is not run for a while.
    bench.network.transmit(bench.node, frame_of(0x180));
    bench.send(0x600);
    bench.world.clock().advance_to(bench.world.now() + 150ms);
    bench.world.run_for(1ms);
  }
  EXPECT_EQ(bench.states, States{InterfaceState::up});
  EXPECT_EQ(bench.port.counters().stalls, 0U);
  EXPECT_EQ(bench.port.counters().sent, 20U);
}

TEST(CanPort, BusOffEndsAllUntilTheLinkWasCycled) {
  Bench bench;
  for (std::uint32_t id = 1; id <= 6; ++id) bench.send(id);
  bench.port.report(Controller::bus_off);
  bench.world.run_for(1ms);
  EXPECT_EQ(bench.endings.texts().size(), 6U);
  EXPECT_EQ(bench.endings.texts().front(), "1:unknown");
  EXPECT_EQ(bench.endings.texts().back(), "6:port_down");
  EXPECT_TRUE(bench.port.state().needs_cycle());
  bench.network.transmit(bench.node, frame_of(0x700));
  bench.world.run_for(1ms);
  EXPECT_TRUE(bench.received.empty());  // it is off the network
  bench.port.cycle();
  bench.world.run_for(1ms);
  EXPECT_TRUE(bench.port.state().can_send());
  EXPECT_EQ(bench.port.counters().bus_offs, 1U);
  EXPECT_EQ(bench.others, Texts{"001#"});  // was on the wire already
}

TEST(CanPort, FollowsAnInterfaceThatGoesAndComes) {
  Bench bench;
  bench.port.report(Controller::passive);
  bench.world.run_for(1ms);
  bench.send(1);
  bench.world.run_for(1ms);
  bench.port.remove();
  bench.send(2);
  bench.world.run_for(1ms);
  bench.port.set_up(true);
  bench.world.run_for(1ms);
  bench.send(3);
  bench.world.run_for(1ms);
  EXPECT_EQ(bench.endings.texts(), (Texts{"1:sent", "2:port_down", "3:sent"}));
  EXPECT_EQ(bench.states, (States{InterfaceState::up, InterfaceState::error_passive, InterfaceState::removed,
                                  InterfaceState::up}));
  EXPECT_EQ(bench.port.counters().openings, 2U);
}

TEST(CanPort, ExpiredFramesEndThoughTheWireIsBusy) {
  Bench bench;
  bench.network.set_stalled(true);
  for (std::uint32_t id = 1; id <= 4; ++id) bench.send(id);
  bench.send(5, options_of(Class::motion, bench.world.now() + 10ms));
  bench.world.run_for(11ms);
  EXPECT_EQ(bench.endings.texts(), Texts{"5:expired"});
}

TEST(CanPort, AFullInterfaceIsTriedAgainAndChosenForAnew) {
  axisd::test::VirtualWorld world;
  Network network(world.clock(), 1'000'000);
  NetworkPort port(world.clock(), {.window = 20, .stall_timeout = 1s}, network);
  test::Endings endings;
  port.start({});
  network.set_stalled(true);
  for (std::uint32_t id = 1; id <= 12; ++id) port.send(frame_of(id), {}, endings.of(id));
  world.run_for(20ms);
  EXPECT_GT(port.counters().no_buffer, 1U);
  EXPECT_TRUE(endings.texts().empty());
  port.send(frame_of(13), options_of(Class::stop), endings.of(13));
  network.set_stalled(false);
  world.run_for(20ms);
  ASSERT_EQ(endings.texts().size(), 13U);
  EXPECT_EQ(endings.texts().at(10), "13:sent");
  EXPECT_EQ(endings.texts().at(11), "11:sent");
}

TEST(CanPort, AHandlerThatClosesIsTheLastToBeCalled) {
  axisd::test::VirtualWorld world;
  Network network(world.clock(), 1'000'000);
  NetworkPort port(world.clock(), {}, network);
  int calls = 0;
  port.start({.on_frame = [&port, &calls](const ReceivedFrame&) {
    port.close();
    ++calls;
  }});
  const auto node = network.join([](const Frame&, TimePoint, bool) {});
  for (std::uint32_t id = 1; id <= 3; ++id) network.transmit(node, frame_of(id));
  world.run_for(10ms);
  EXPECT_EQ(calls, 1);
}

TEST(CanPort, AHandlerMaySendAndClose) {
  Bench bench;
  bench.port.send(frame_of(1), {}, [&](const SendResult&) {
    bench.send(2);
    bench.send(3);
  });
  bench.world.run_for(1ms);
  EXPECT_EQ(bench.endings.texts(), (Texts{"2:sent", "3:sent"}));
  bench.network.set_stalled(true);
  bench.send(4);
  bench.port.send(frame_of(5), {}, [&](const SendResult&) { bench.send(6); });
  bench.port.close();
  EXPECT_EQ(bench.endings.texts(), (Texts{"2:sent", "3:sent", "4:unknown", "6:port_down"}));
  bench.network.set_stalled(false);
  bench.network.transmit(bench.node, frame_of(0x700));
  bench.send(7);
  bench.world.run_for(1ms);
  EXPECT_EQ(bench.endings.texts().back(), "7:port_down");
  EXPECT_TRUE(bench.received.empty());
  EXPECT_TRUE(bench.others.size() == 3);  // 1, 2 and 3
}

}  // namespace
}  // namespace axisd::can
