// What ends a round, and what must not.
#include <gtest/gtest.h>

#include <algorithm>

#include "watch_rig.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;
using test::WatchRig;
using Order = std::vector<int>;

/// Whoever ended it waits for it: also where that was before the round.
TEST(RtuBusRound, WhatWasEndedIsToldWithItsOwnReply) {
  for (const std::uint8_t node : {1, 2, 3, 4})
    for (Duration offset{}; offset < 30ms; offset += 331us) {
      SCOPED_TRACE(testing::Message() << int{node} << " after " << offset.count() << " ns");
      WatchRig rig;
      const auto next = rig.settle();
      rig.run_until(next + offset);
      const auto asked = rig.world.now();
      rig.bus->end_repetition(node);
      rig.run_until(next + WatchRig::period / 2);
      ASSERT_TRUE(rig.ended(node));
      const auto& end = rig.ends[node].front();
      ASSERT_TRUE(end.result);
      if (!end.result->has_value()) continue;
      const auto under_way = std::ranges::find_if(
          rig.line->wire(), [&](const auto& one) { return one.begin <= asked && one.end > asked; });
      const auto latest = under_way == rig.line->wire().end() ? asked : under_way->end;
      ASSERT_LE(end.at, std::max(rig.entry(node)->end, latest));
    }
}

/// What waits for a node that does not answer takes no turn, and so ends no round.
TEST(RtuBusRound, WhatIsHeldBackEndsNone) {
  for (const bool held : {false, true}) {
    SCOPED_TRACE(held);
    WatchRig rig(5);
    if (held) rig.line->network().node(5)->set_power(false);
    for (std::uint8_t node = 1; node <= 4; ++node) rig.watch(node);
    // A period that begins while something is held back, to its end.
    for (int i = 0; i < 60; ++i) {
      if (held && rig.bus->held_back() == 0)
        rig.read("in vain", 5, TransactionClass::parameters, 0x0003, static_cast<std::uint16_t>(1 + i % 8));
      rig.world.run_for(WatchRig::period / 2);
      rig.told.clear();
      rig.line->forget_wire();
      ASSERT_TRUE(rig.run_until_asked(2));
      if (i > 20 && (rig.bus->held_back() > 0) == held) break;
    }
    ASSERT_EQ(rig.bus->held_back() > 0, held);
    rig.read("plain", 4, TransactionClass::idle_state, 0x0003, 2);  // it joins no round under way
    rig.world.run_for(80ms);
    const auto told = rig.told_of(2);
    ASSERT_EQ(told.size(), 1U);
    EXPECT_EQ(told.front().at, rig.entry(4)->end) << "with the last of the round";
  }
}

/// They wait as those in the queue do.
TEST(RtuBusRound, AReadingBehindTheOneUnderWayIsGivenUp) {
  WatchRig rig;
  const auto next = rig.settle();
  rig.run_until(next);
  ASSERT_TRUE(rig.run_until_asked(2));
  rig.bus->give_up_readings(4);
  rig.run_until(next + WatchRig::period / 2);
  EXPECT_EQ(rig.order(), (Order{1, 2, 3}));
  ASSERT_TRUE(rig.ended(4));
  const auto& result = rig.ends[4].front().result;
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().reason, Reason::superseded);
}

/// A reading that was taken back out of a round, and before which another has to go now: nothing stands
/// behind that one, though its reply is known.
TEST(RtuBusRound, ATakenBackReadingBeforeWhichAnotherGoesHasNothingBehindIt) {
  WatchRig rig(3);
  rig.watch(1, 50ms, 1);
  rig.world.run_for(510ms);
  rig.bus->end_repetition(1);
  rig.world.run_for(10ms);
  ASSERT_TRUE(rig.ended(1));
  rig.told.clear();
  rig.line->forget_wire();
  rig.read("busy", 3, TransactionClass::idle_state, 0x0003, 2);
  rig.watch(1);
  rig.watch(2);
  while (rig.results.empty()) rig.world.run_for(50us);
  ASSERT_EQ(rig.order(), Order{3}) << "a round is armed, in the silence";
  rig.line->network().faults().add({.kind = FaultKind::drop_reply, .node = 1, .function = 3});
  rig.read("lost", 1, TransactionClass::moving_state, 0x0003, WatchRig::watched_count);
  rig.world.run_for(150ms);
  const auto& wire = rig.line->wire();
  ASSERT_GE(wire.size(), 4U);
  EXPECT_EQ(wire[1].address(), 0x0003);
  EXPECT_EQ(wire[2].value(), 1) << "of another length, as the reply to the one before may be late";
  EXPECT_EQ(wire[3].node(), 1);
  EXPECT_EQ(std::ranges::count(wire, 2, &test::WireEntry::node), 1) << "it was read and nobody was told";
  EXPECT_EQ(rig.told_of(2).size(), 1U);
}

/// What goes out before another ends with the bus, and so does the other.
TEST(RtuBusRound, AClosedBusEndsWhatAnotherOneWentOutBefore) {
  WatchRig rig(1);
  rig.read("first", 1, TransactionClass::idle_state);
  rig.world.run_for(50ms);
  rig.line->network().faults().add({.kind = FaultKind::drop_reply, .node = 1, .function = 3});
  rig.read("lost", 1, TransactionClass::idle_state);
  rig.world.run_for(50ms);
  rig.line->forget_wire();
  rig.watch(1);
  ASSERT_TRUE(rig.run_until_asked(1));
  ASSERT_NE(rig.line->wire().front().value(), WatchRig::watched_count);
  rig.bus->close();
  rig.world.run_for(1s);
  EXPECT_TRUE(rig.bus->idle());
  EXPECT_EQ(rig.ends[1].size(), 1U);
}

}  // namespace
}  // namespace axisd::modbus_rtu
