// SocketCanPort on virtual interfaces.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>

#include "tests/can/bench.hpp"

namespace axisd::can {
namespace {

using namespace std::chrono_literals;
using test::Bench;
using test::frame_of;
using test::ip;
using test::Peer;
using test::settings_of;
using States = std::vector<InterfaceState>;
using Texts = std::vector<std::string>;

class Vcan : public ::testing::Test {
 protected:
  Vcan() {
    ip("link add cell type vcan\nlink set cell up");
    bench.start();
    EXPECT_TRUE(bench.until(InterfaceState::up));
  }
  ~Vcan() override { ip("link del cell"); }

  Bench bench{settings_of("cell")};
};

TEST_F(Vcan, SendsWithEchoAndReceivesWithTimeStamps) {
  Peer peer("cell");
  const Frame frames[] = {frame_of(0x205, {0x0F, 0, 1}),
                          {.id = 0x18FF0102, .extended = true, .size = 1, .data = {7}},
                          {.id = 0x701, .rtr = true, .size = 1}};
  const auto before = bench.clock.now();
  for (const auto& frame : frames) bench.port.send(frame, {}, bench.endings.of(frame.id));
  ASSERT_TRUE(bench.until_ended(3));
  EXPECT_EQ(peer.received(), (Texts{"205#0F0001", "18FF0102#07", "701#R1"}));
  for (const auto& frame : frames) EXPECT_TRUE(peer.send(frame));
  ASSERT_TRUE(bench.until([&] { return bench.received.size() == 3; }));
  const auto after = bench.clock.now();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(bench.received.at(i).frame, frames[i]);
    // The two clocks are read one after the other: in order but for that.
    EXPECT_GE(bench.received.at(i).at, before - 5ms);
    EXPECT_LE(bench.received.at(i).at, after);
    EXPECT_EQ(bench.endings.results().at(i).status, SendStatus::sent);
    EXPECT_GE(bench.endings.results().at(i).handed_over, before);
    EXPECT_LE(bench.endings.results().at(i).sent_at, bench.received.at(i).at + 5ms);
  }
  EXPECT_EQ(bench.port.counters().sent, 3U);
  EXPECT_EQ(bench.port.counters().received, 3U);
}

TEST_F(Vcan, FramesThatGatherComeInOrderWithTheirOwnTimes) {
  bench.patient = true;
  Peer peer("cell");
  std::uint32_t last = 0;
  // More than is taken at once, then some that come while others gather, then one alone.
  for (const auto count : {100U, 3U, 1U}) {
    for (std::uint32_t i = 0; i < count; ++i) ASSERT_TRUE(peer.send(frame_of(++last)));
    ASSERT_TRUE(bench.until([&] { return bench.received.size() == last; }));
  }
  for (std::uint32_t i = 0; i < last; ++i) {
    EXPECT_EQ(bench.received.at(i).frame.id, i + 1);
    // The two clocks are read one after the other: in order but for that.
    if (i > 0) EXPECT_GE(bench.received.at(i).at, bench.received.at(i - 1).at - 5ms);
  }
  // What is sent meanwhile is confirmed all the same, and an interface that goes while frames gather is seen.
  bench.send(1);
  ASSERT_TRUE(bench.until_ended(1));
  EXPECT_EQ(bench.endings.texts(), Texts{"1:sent"});
  ASSERT_TRUE(peer.send(frame_of(1)));
  ip("link set cell down");
  ASSERT_TRUE(bench.until(InterfaceState::down));
  ip("link set cell up");
  ASSERT_TRUE(bench.until(InterfaceState::up));
  const auto before = bench.received.size();
  ASSERT_TRUE(bench.until([&] { return peer.send(frame_of(2)); }));
  ASSERT_TRUE(bench.until([&] { return bench.received.size() > before; }));
}

TEST_F(Vcan, AStopOvertakesWhatIsQueued) {
  Peer peer("cell");
  for (std::uint32_t id = 1; id <= 6; ++id) bench.send(id);
  bench.send(7, TransactionClass::stop);
  ASSERT_TRUE(bench.until_ended(7));
  EXPECT_EQ(peer.received(), (Texts{"001#", "002#", "003#", "004#", "007#", "005#", "006#"}));
}

TEST_F(Vcan, SendsAgainAfterDownAndUpButNothingOfBefore) {
  Peer peer("cell");
  ip("link set cell down");
  bench.send(1);  // the port does not know yet
  ASSERT_TRUE(bench.until(InterfaceState::down));
  bench.send(2);
  ASSERT_TRUE(bench.until_ended(2));
  EXPECT_EQ(bench.endings.texts(), (Texts{"1:port_down", "2:port_down"}));
  EXPECT_NE(bench.port.state().error->message.find("down"), std::string::npos);
  ip("link set cell up");
  ASSERT_TRUE(bench.until(InterfaceState::up));
  bench.linger();
  peer.received();  // ends the error that a plain socket has pending
  bench.send(3);
  ASSERT_TRUE(bench.until_ended(3));
  EXPECT_EQ(bench.endings.texts().back(), "3:sent");
  EXPECT_EQ(peer.received(), Texts{"003#"});
  EXPECT_EQ(bench.port.counters().openings, 1U);  // the same socket serves
}

TEST_F(Vcan, SeesAnInterfaceThatWasDownForAMoment) {
  bench.linger();
  ip("link set cell down\nlink set cell up");
  ASSERT_TRUE(bench.until([&] { return bench.states.size() >= 3; }));
  bench.linger();
  EXPECT_EQ(bench.states, (States{InterfaceState::up, InterfaceState::down, InterfaceState::up}));
}

TEST_F(Vcan, SendsAndReceivesOnAnInterfaceCreatedAnew) {
  ip("link del cell");
  ASSERT_TRUE(bench.until(InterfaceState::removed));
  bench.send(1);
  ASSERT_TRUE(bench.until_ended(1));
  EXPECT_EQ(bench.endings.texts(), Texts{"1:port_down"});
  ip("link add cell type vcan\nlink set cell up");
  ASSERT_TRUE(bench.until(InterfaceState::up));
  Peer peer("cell");
  bench.send(2);
  EXPECT_TRUE(peer.send(frame_of(3)));
  ASSERT_TRUE(bench.until([&] { return bench.endings.texts().size() == 2 && bench.received.size() == 1; }));
  EXPECT_EQ(peer.received(), Texts{"002#"});
  EXPECT_EQ(bench.port.counters().openings, 2U);
}

TEST_F(Vcan, SeesAnInterfaceReplacedInAMoment) {
  bench.linger();
  ip("link del cell\nlink add cell type vcan\nlink set cell up");
  ASSERT_TRUE(bench.until([&] { return bench.port.counters().openings == 2; }));
  Peer peer("cell");
  EXPECT_TRUE(peer.send(frame_of(3)));
  ASSERT_TRUE(bench.until([&] { return bench.received.size() == 1; }));
}

TEST_F(Vcan, FollowsTheNameNotTheInterface) {
  ip("link set cell down\nlink set cell name other\nlink set other up");
  ASSERT_TRUE(bench.until(InterfaceState::removed));
  bench.linger();
  EXPECT_EQ(bench.port.state().link, InterfaceState::removed);
  ip("link set other down\nlink set other name cell\nlink set cell up");
  EXPECT_TRUE(bench.until(InterfaceState::up));
}

TEST_F(Vcan, AfterBusOffNothingIsSentUntilTheLinkWasCycled) {
  Peer peer("cell");
  for (std::uint32_t id = 1; id <= 6; ++id) bench.send(id);
  peer.report_error(CAN_ERR_BUSOFF);
  ASSERT_TRUE(bench.until(InterfaceState::bus_off));
  ASSERT_TRUE(bench.until_ended(6));
  peer.received();
  peer.report_error(CAN_ERR_RESTARTED);  // a controller that restarts by itself changes nothing
  peer.report_error(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE);
  bench.send(7, TransactionClass::stop);
  ASSERT_TRUE(bench.until_ended(7));
  EXPECT_EQ(bench.endings.texts().back(), "7:port_down");
  bench.linger();
  EXPECT_TRUE(peer.received().empty());
  EXPECT_TRUE(bench.port.state().needs_cycle());
  ip("link set cell down\nlink set cell up");
  ASSERT_TRUE(bench.until(InterfaceState::up));
  peer.received();
  bench.send(8);
  ASSERT_TRUE(bench.until_ended(8));
  EXPECT_EQ(peer.received(), Texts{"008#"});
  EXPECT_EQ(bench.port.counters().bus_offs, 1U);
}

TEST_F(Vcan, ErrorPassiveIsToldAndStillSends) {
  Peer peer("cell");
  peer.report_error(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE);
  ASSERT_TRUE(bench.until(InterfaceState::error_passive));
  bench.send(1);
  ASSERT_TRUE(bench.until_ended(1));
  EXPECT_EQ(bench.endings.texts(), Texts{"1:sent"});
  peer.report_error(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE);
  EXPECT_TRUE(bench.until(InterfaceState::up));
  EXPECT_EQ(bench.port.counters().error_frames, 2U);
  EXPECT_TRUE(bench.received.empty());  // error frames are no frames
}

TEST_F(Vcan, TakesFramesThatCameTogetherInOrderAndThenWhatFollows) {
  Peer peer("cell");
  const auto before = bench.clock.now();
  constexpr std::uint32_t burst = 100;  // more than it takes at once
  for (std::uint32_t i = 0; i < burst; ++i)
    EXPECT_TRUE(peer.send(frame_of(i, {static_cast<std::uint8_t>(i)})));
  bench.send(burst);
  ASSERT_TRUE(bench.until_ended(1));
  const auto after = bench.clock.now();
  ASSERT_EQ(bench.received.size(), burst);
  for (std::uint32_t i = 0; i < burst; ++i) {
    const auto& each = bench.received.at(i);
    EXPECT_EQ(each.frame, frame_of(i, {static_cast<std::uint8_t>(i)}));
    EXPECT_GE(each.at, before - 5ms);  // as the two clocks are read one after the other
    EXPECT_LE(each.at, after);
  }
  EXPECT_EQ(bench.endings.texts(), (Texts{fmt::format("{}:sent", burst)}));
}

TEST_F(Vcan, CountsWhatTheKernelDropped) {
  Peer peer("cell");
  constexpr std::size_t flood = 20'000;
  for (std::size_t i = 0; i < flood; ++i) EXPECT_TRUE(peer.send(frame_of(0x181, {1, 2})));
  bench.linger();
  EXPECT_TRUE(peer.send(frame_of(0x182)));  // tells how many were lost before it
  ASSERT_TRUE(
      bench.until([&] { return !bench.received.empty() && bench.received.back().frame.id == 0x182; }));
  const auto& counters = bench.port.counters();
  EXPECT_GT(counters.receive_overflows, 0U);
  EXPECT_EQ(counters.received + counters.receive_overflows, flood + 1);
}

TEST(SocketCan, WaitsForAnInterfaceThatIsNotThereYet) {
  Bench bench(settings_of("later"));
  bench.start();
  ASSERT_TRUE(bench.until([&] { return !bench.states.empty(); }));
  EXPECT_EQ(bench.states, States{InterfaceState::removed});
  EXPECT_NE(bench.port.state().error->message.find("later"), std::string::npos);
  ip("link add later type vcan");
  ASSERT_TRUE(bench.until(InterfaceState::down));
  ip("link set later up");
  EXPECT_TRUE(bench.until(InterfaceState::up));
  ip("link del later");
}

TEST(SocketCan, RefusesWhatCarriesNoCanAndWhatIsNoName) {
  for (const auto* name : {"lo", "a-name-that-is-too-long"}) {
    Bench bench(settings_of(name));
    bench.start();
    ASSERT_TRUE(bench.until(InterfaceState::down)) << name;
    EXPECT_EQ(bench.port.state().error->reason, Reason::misconfigured) << name;
  }
}

TEST(SocketCan, PortsOnOneInterfaceHearEachOther) {
  Bench one(settings_of("vcan0"));
  Bench other(settings_of("vcan0"));
  one.start();
  other.start();
  ASSERT_TRUE(one.until(InterfaceState::up));
  ASSERT_TRUE(other.until(InterfaceState::up));
  one.send(0x123);
  ASSERT_TRUE(one.until_ended(1));
  ASSERT_TRUE(other.until([&] { return other.received.size() == 1; }));
  EXPECT_TRUE(one.received.empty());
}

}  // namespace
}  // namespace axisd::can
