// SocketCanPort on a genuine controller interface, whose adapter can be made to stall and to go bus-off.
#include <gtest/gtest.h>

#include "tests/can/bench.hpp"
#include "tests/can/slcan_adapter.hpp"

namespace axisd::can {
namespace {

using namespace std::chrono_literals;
using test::Bench;
using test::frame_of;
using test::ip;
using test::Peer;
using test::settings_of;
using test::SlcanAdapter;
using Texts = std::vector<std::string>;

PortSettings settings_for(const SlcanAdapter& adapter, std::uint32_t bitrate = 0) {
  auto settings = settings_of(adapter.interface());
  settings.bitrate = bitrate;
  return settings;
}

/// Waits until the adapter was given something.
std::string taken(Bench& bench, SlcanAdapter& adapter) {
  std::string frames;
  bench.until([&] { return !(frames = adapter.taken()).empty(); });
  return frames;
}

TEST(Slcan, ABitRateThatDiffersIsAnErrorAndNothingIsSent) {
  SlcanAdapter adapter(250'000);
  ip("link set " + adapter.interface() + " up");
  Bench bench(settings_for(adapter, 500'000));
  bench.start();
  ASSERT_TRUE(bench.until([&] { return !bench.states.empty(); }));
  EXPECT_EQ(bench.port.state().link, InterfaceState::down);
  EXPECT_EQ(bench.port.state().error->reason, Reason::misconfigured);
  EXPECT_NE(bench.port.state().error->message.find("250000"), std::string::npos);
  bench.send(1);
  ASSERT_TRUE(bench.until_ended(1));
  EXPECT_EQ(bench.endings.texts(), Texts{"1:port_down"});
  ip("link set " + adapter.interface() + " down\nlink set " + adapter.interface() +
     " type can bitrate 500000\nlink set " + adapter.interface() + " up");
  ASSERT_TRUE(bench.until(InterfaceState::up));
  bench.send(2);
  EXPECT_EQ(taken(bench, adapter), "t002");
}

TEST(Slcan, WhatAStalledAdapterDidNotTakeIsNeverSent) {
  SlcanAdapter adapter;
  ip("link set " + adapter.interface() + " up");
  Bench bench(settings_for(adapter));
  bench.start();
  ASSERT_TRUE(bench.until(InterfaceState::up));
  bench.send(0x100);
  ASSERT_TRUE(bench.until_ended(1));
  ASSERT_EQ(taken(bench, adapter), "t100");

  adapter.set_stalled(true);
  bench.linger();
  for (std::uint32_t id = 0x101; id <= 0x108; ++id) bench.send(id);
  ASSERT_TRUE(bench.until(InterfaceState::stalled));
  ASSERT_TRUE(bench.until_ended(9));
  // The echoes came at once here, but they are no proof while the kernel holds frames.
  EXPECT_EQ(bench.endings.texts(),
            (Texts{"256:sent", "257:unknown", "258:unknown", "259:unknown", "260:unknown", "261:port_down",
                   "262:port_down", "263:port_down", "264:port_down"}));
  bench.send(0x110, TransactionClass::stop);
  ASSERT_TRUE(bench.until_ended(10));
  EXPECT_EQ(bench.endings.texts().back(), "272:port_down");

  ip("link set " + adapter.interface() + " down");
  adapter.set_stalled(false);
  ip("link set " + adapter.interface() + " up");
  ASSERT_TRUE(bench.until(InterfaceState::up));
  bench.linger();
  EXPECT_EQ(adapter.taken(), "t101");  // it had left the kernel before
  bench.send(0x111, TransactionClass::stop);
  EXPECT_EQ(taken(bench, adapter), "t111");
  EXPECT_EQ(bench.port.counters().stalls, 1U);
}

TEST(Slcan, BacksOffWhileOthersFillTheQueueAndSendsThen) {
  SlcanAdapter adapter;
  ip("link set " + adapter.interface() + " up");
  auto settings = settings_for(adapter);
  settings.stall_timeout = 5s;
  Bench bench(settings);
  bench.start();
  ASSERT_TRUE(bench.until(InterfaceState::up));
  adapter.set_stalled(true);
  bench.linger();
  Peer peer(adapter.interface());
  int filled = 0;
  while (filled < 100 && peer.send(frame_of(0x500))) ++filled;
  ASSERT_LT(filled, 100);
  bench.send(1);
  ASSERT_TRUE(bench.until([&] { return bench.port.counters().no_buffer >= 3; }));
  bench.send(2, TransactionClass::stop);
  EXPECT_TRUE(bench.endings.texts().empty());
  adapter.set_stalled(false);
  ASSERT_TRUE(bench.until_ended(2));
  EXPECT_EQ(bench.endings.texts(),
            (Texts{"2:sent", "1:sent"}));  // the order is that of the moment when there is room
}

TEST(Slcan, AQueueThatStaysFullIsAStall) {
  SlcanAdapter adapter;
  ip("link set " + adapter.interface() + " up");
  Bench bench(settings_for(adapter));
  bench.start();
  ASSERT_TRUE(bench.until(InterfaceState::up));
  adapter.set_stalled(true);
  bench.linger();
  Peer peer(adapter.interface());
  for (int filled = 0; filled < 100 && peer.send(frame_of(0x500)); ++filled) {
  }
  bench.send(1);
  ASSERT_TRUE(bench.until(InterfaceState::stalled));
  ASSERT_TRUE(bench.until_ended(1));
  EXPECT_EQ(bench.endings.texts(), Texts{"1:port_down"});  // known not to be sent
  ip("link set " + adapter.interface() + " down");
  adapter.set_stalled(false);
  ip("link set " + adapter.interface() + " up");
  ASSERT_TRUE(bench.until(InterfaceState::up));
  bench.linger();
  EXPECT_EQ(adapter.taken().find("t001"), std::string::npos);
}

TEST(Slcan, BusOffOfTheControllerLastsUntilTheCycle) {
  SlcanAdapter adapter;
  ip("link set " + adapter.interface() + " up");
  Bench bench(settings_for(adapter));
  bench.start();
  ASSERT_TRUE(bench.until(InterfaceState::up));
  adapter.say("sp130010\r");
  ASSERT_TRUE(bench.until(InterfaceState::error_passive));
  adapter.say("sb000256\r");
  ASSERT_TRUE(bench.until(InterfaceState::bus_off));
  bench.send(1);  // the kernel would take and drop it
  ASSERT_TRUE(bench.until_ended(1));
  EXPECT_EQ(bench.endings.texts(), Texts{"1:port_down"});
  ip("link set " + adapter.interface() + " down\nlink set " + adapter.interface() + " up");
  ASSERT_TRUE(bench.until(InterfaceState::up));
  bench.send(2, TransactionClass::stop);
  EXPECT_EQ(taken(bench, adapter), "t002");
}

TEST(Slcan, BusOffOfBeforeTheStartIsSeen) {
  SlcanAdapter adapter;
  ip("link set " + adapter.interface() + " up");
  {
    Bench bench(settings_for(adapter));
    bench.start();
    ASSERT_TRUE(bench.until(InterfaceState::up));
    adapter.say("sb000256\r");
    ASSERT_TRUE(bench.until(InterfaceState::bus_off));
  }
  Bench bench(settings_for(adapter));
  bench.start();
  ASSERT_TRUE(bench.until([&] { return !bench.states.empty(); }));
  EXPECT_EQ(bench.states, std::vector<InterfaceState>{InterfaceState::bus_off});
}

TEST(Slcan, AnAdapterThatIsUnpluggedIsRemoved) {
  auto adapter = std::make_unique<SlcanAdapter>();
  ip("link set " + adapter->interface() + " up");
  Bench bench(settings_for(*adapter));
  bench.start();
  ASSERT_TRUE(bench.until(InterfaceState::up));
  adapter.reset();
  EXPECT_TRUE(bench.until(InterfaceState::removed));
}

}  // namespace
}  // namespace axisd::can
