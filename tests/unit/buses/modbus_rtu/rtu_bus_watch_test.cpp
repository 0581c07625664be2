// Readings that the bus repeats by itself, alone and in rounds.
#include <gtest/gtest.h>

#include <algorithm>

#include "watch_rig.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using test::WatchRig;
using Order = std::vector<int>;

TEST(RtuBusWatch, IsRepeatedAtItsPeriodUntilAnAnswerSaysSomethingNew) {
  WatchRig rig(1);
  rig.watch(1, 100ms);
  rig.world.run_for(950ms);
  const auto& wire = rig.line->wire();
  ASSERT_EQ(wire.size(), 10U);
  for (std::size_t i = 1; i < wire.size(); ++i) EXPECT_EQ(wire[i].begin - wire[i - 1].begin, 100ms);
  EXPECT_EQ(rig.told.size(), 10U);
  EXPECT_FALSE(rig.ended(1));
  rig.expect_told_as_sent();
  rig.poke(1, 7);
  rig.world.run_for(1s);
  ASSERT_EQ(rig.ends[1].size(), 1U);
  const auto& end = rig.ends[1].front();
  ASSERT_TRUE(end.result && *end.result);
  EXPECT_EQ((*end.result)->registers, (std::vector<std::uint16_t>{7, 0x1001, 0x1002, 0x1003}));
  EXPECT_EQ((*end.result)->sent_at, wire.back().begin);
  EXPECT_EQ((*end.result)->answered_at, wire.back().end);
  EXPECT_EQ(end.at, wire.back().end) << "at once";
  EXPECT_EQ(wire.size(), 11U) << "it is not repeated any more";
  EXPECT_TRUE(rig.bus->idle());
}

TEST(RtuBusWatch, AnotherOneFollowsTheOneThatEnded) {
  WatchRig rig(1);
  for (std::uint16_t value = 1; value <= 3; ++value) {
    rig.watch(1, 50ms);
    rig.world.run_for(500ms);
    EXPECT_EQ(rig.ends[1].size(), value - 1U);
    rig.poke(1, value);
    rig.world.run_for(60ms);
    EXPECT_EQ(rig.ends[1].size(), value);
  }
  rig.expect_told_as_sent();
}

TEST(RtuBusWatch, ARoundIsToldTogetherAndInItsOrder) {
  WatchRig rig;
  const auto next = rig.settle();
  rig.run_until(next + WatchRig::period / 2);
  EXPECT_EQ(rig.order(), (Order{1, 2, 3, 4}));
  rig.expect_silences();
  rig.expect_told_as_sent();
  ASSERT_EQ(rig.told.size(), 4U);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(rig.told[i].at, rig.line->wire().back().end);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(rig.told[i].answered_at, rig.line->wire()[i].end);
  for (const auto& one : rig.told) EXPECT_EQ(one.registers.front(), WatchRig::value_of(one.node));
  EXPECT_TRUE(rig.ends.empty());
}

TEST(RtuBusWatch, AChangedReplyInARoundIsToldAtOnceAndTheOthersFollow) {
  for (const std::uint8_t changed : {1, 2, 3, 4}) {
    SCOPED_TRACE(int{changed});
    WatchRig rig;
    const auto next = rig.settle();
    rig.poke(changed, 7);
    rig.run_until(next + WatchRig::period / 2);
    EXPECT_EQ(rig.order(), (Order{1, 2, 3, 4}));
    rig.expect_silences();
    rig.expect_told_as_sent();
    const auto* entry = rig.entry(changed);
    ASSERT_EQ(rig.told_of(changed).size(), 1U);
    EXPECT_EQ(rig.told_of(changed).front().at, entry->end);
    ASSERT_TRUE(rig.ended(changed));
    EXPECT_EQ(rig.ends[changed].front().at, entry->end);
    EXPECT_EQ((*rig.ends[changed].front().result)->registers.front(), 7);
    EXPECT_EQ(rig.ends.size(), 1U);
    rig.line->forget_wire();
    rig.run_until(next + 3 * WatchRig::period / 2);
    EXPECT_EQ(rig.line->wire().size(), 3U);
    EXPECT_EQ(rig.entry(changed), nullptr);
  }
}

TEST(RtuBusWatch, ARoundIsBounded) {
  WatchRig rig(8);
  for (std::uint8_t node = 1; node <= 8; ++node) rig.watch(node, 300ms, 16);
  rig.world.run_for(2s);
  rig.expect_silences();
  rig.expect_told_as_sent();
  const auto turnarounds = 8 * 2ms;
  for (const auto& one : rig.told) EXPECT_LE(one.at - one.sent_at, 40ms + turnarounds);
  EXPECT_TRUE(rig.ends.empty());
}

TEST(RtuBusWatch, OnAFullLineEachHasItsTurn) {
  WatchRig rig(8);
  for (std::uint8_t node = 1; node <= 8; ++node) rig.watch(node, 1ms);
  rig.world.run_for(1s);
  rig.expect_silences();
  std::vector<std::ptrdiff_t> counts;
  for (std::uint8_t node = 1; node <= 8; ++node)
    counts.push_back(std::ranges::count(rig.line->wire(), node, &test::WireEntry::node));
  const auto [least, most] = std::ranges::minmax(counts);
  EXPECT_LE(most - least, 1);
  EXPECT_GE(least, 20);
  EXPECT_TRUE(rig.ends.empty());
}

TEST(RtuBusWatchEnd, BetweenTwoReadingsThereIsNone) {
  WatchRig rig;
  rig.settle();
  const auto now = rig.world.now();
  rig.bus->end_repetition(3);
  rig.bus->end_repetition(3);
  rig.world.run_for(1us);
  ASSERT_TRUE(rig.ended(3));
  ASSERT_TRUE(rig.ends[3].front().result);
  EXPECT_FALSE(rig.ends[3].front().result->has_value());
  EXPECT_EQ(rig.ends[3].front().at, now);
  rig.world.run_for(WatchRig::period);
  EXPECT_EQ(rig.order(), (Order{1, 2, 4}));
  EXPECT_EQ(rig.ends.size(), 1U);
  EXPECT_EQ(rig.ends[3].size(), 1U);
}

TEST(RtuBusWatchEnd, OfNothingThatIsWatchedIsNothing) {
  WatchRig rig;
  rig.bus->end_repetition(3);
  rig.read("plain", 3, TransactionClass::idle_state);
  rig.bus->end_repetition(3);
  rig.world.run_for(100ms);
  ASSERT_EQ(rig.results["plain"].size(), 1U);
  EXPECT_TRUE(rig.results["plain"].front());
}

/// At any moment: it ends once, at once where it rests, else with its next answer.
TEST(RtuBusWatchEnd, AtAnyMomentOfARound) {
  for (const std::uint8_t node : {1, 2, 3, 4})
    for (Duration offset = -1ms; offset < 30ms; offset += 331us) {
      SCOPED_TRACE(testing::Message() << int{node} << " after " << offset.count() << " ns");
      WatchRig rig;
      const auto next = rig.settle();
      rig.run_until(next + offset);
      const auto asked = rig.world.now();
      const bool was_read = !rig.told_of(node).empty();
      rig.bus->end_repetition(node);
      rig.run_until(next + WatchRig::period / 2);
      ASSERT_TRUE(rig.ended(node));
      ASSERT_EQ(rig.ends[node].size(), 1U);
      const auto& end = rig.ends[node].front();
      ASSERT_TRUE(end.result);
      if (offset < Duration::zero()) {
        EXPECT_FALSE(end.result->has_value());
        EXPECT_EQ(rig.entry(node), nullptr);
      }
      if (end.result->has_value()) {
        EXPECT_FALSE(was_read);
        const auto* entry = rig.entry(node);
        ASSERT_NE(entry, nullptr);
        EXPECT_EQ((*end.result)->sent_at, entry->begin);
      } else {
        EXPECT_EQ(end.at, asked);
      }
      EXPECT_EQ(rig.ends.size(), 1U);
      EXPECT_LE(rig.line->wire().size(), 4U) << "none is read twice";
      EXPECT_GE(rig.line->wire().size(), 3U);
      EXPECT_TRUE(std::ranges::is_sorted(rig.order()));
      rig.expect_silences();
      rig.line->forget_wire();
      rig.run_until(next + 3 * WatchRig::period / 2);
      EXPECT_EQ(rig.line->wire().size(), 3U);
      EXPECT_EQ(rig.entry(node), nullptr);
    }
}

TEST(RtuBusWatch, ASilentNodeEndsItsOwnAndTheOthersGoOn) {
  WatchRig rig;
  const auto next = rig.settle();
  rig.line->network().node(3)->set_power(false);
  rig.run_until(next + WatchRig::period / 2);
  EXPECT_EQ(rig.order(), (Order{1, 2, 3, 4}));
  ASSERT_TRUE(rig.ended(3));
  EXPECT_EQ(rig.ends[3].front().result.error().reason, Reason::no_reply);
  EXPECT_EQ(rig.ends[3].front().at, rig.entry(3)->end);
  EXPECT_EQ(rig.told_of(4).front().at, rig.entry(4)->end);
  EXPECT_EQ(rig.told.size(), 3U);
  rig.run_until(next + 7 * WatchRig::period / 2);
  EXPECT_EQ(rig.told.size(), 12U);
  EXPECT_EQ(rig.ends.size(), 1U);
  EXPECT_EQ(rig.bus->counters().timeouts, 1U);
  rig.expect_silences();
}

TEST(RtuBusWatch, ARefusalEndsIt) {
  WatchRig rig(2);
  rig.watch(2, 100ms, 1, 0x0500);  // a drive has no such register
  rig.watch(1);
  rig.world.run_for(500ms);
  ASSERT_EQ(rig.ends[2].size(), 1U);
  EXPECT_EQ(rig.ends[2].front().result.error().reason, Reason::refused);
  EXPECT_FALSE(rig.ended(1));
}

TEST(RtuBusWatch, ALostPortEndsEachOnce) {
  for (Duration offset = -1ms; offset < 30ms; offset += 331us) {
    SCOPED_TRACE(offset.count());
    WatchRig rig;
    const auto next = rig.settle();
    rig.run_until(next + offset);
    rig.line->set_open(false);
    rig.world.run_for(100ms);
    for (std::uint8_t node = 1; node <= 4; ++node) {
      ASSERT_EQ(rig.ends[node].size(), 1U) << int{node};
      const auto& result = rig.ends[node].front().result;
      // Carried out before, but not told yet: it has its answer.
      if (result)
        EXPECT_TRUE(result->has_value());
      else
        EXPECT_EQ(result.error().reason, Reason::bus_down);
    }
    EXPECT_TRUE(rig.bus->idle());
    const auto asked = rig.line->wire().size();
    EXPECT_LE(asked, 4U);
    rig.line->set_open(true);
    rig.world.run_for(1s);
    EXPECT_EQ(rig.line->wire().size(), asked) << "nobody asks any more";
    rig.ends.clear();
    rig.watch_all();
    rig.world.run_for(1s);
    EXPECT_TRUE(rig.ends.empty()) << "watched anew";
  }
}

TEST(RtuBusWatch, AClosedBusEndsEachOnce) {
  for (Duration offset = -1ms; offset < 30ms; offset += 331us) {
    SCOPED_TRACE(offset.count());
    WatchRig rig;
    const auto next = rig.settle();
    rig.run_until(next + offset);
    const auto asked = rig.line->wire().size();
    rig.bus->close();
    rig.world.run_for(1s);
    for (std::uint8_t node = 1; node <= 4; ++node) {
      ASSERT_EQ(rig.ends[node].size(), 1U) << int{node};
      const auto& result = rig.ends[node].front().result;
      if (!result) EXPECT_EQ(result.error().reason, Reason::cancelled);
    }
    EXPECT_TRUE(rig.bus->idle());
    EXPECT_EQ(rig.line->wire().size(), asked) << "nothing goes out any more";
    rig.watch(1);
    rig.world.run_for(1s);
    EXPECT_EQ(rig.ends[1].size(), 2U);
    EXPECT_FALSE(rig.ends[1].back().result);
  }
}

TEST(RtuBusWatch, ReadingsThatAreGivenUpWhileTheyWaitOrRest) {
  WatchRig rig;
  const auto next = rig.settle();
  rig.bus->give_up_readings(4);
  rig.world.run_for(1us);
  ASSERT_TRUE(rig.ended(4));
  ASSERT_TRUE(rig.ends[4].front().result);
  EXPECT_FALSE(rig.ends[4].front().result->has_value()) << "it rested";
  rig.run_until(next + 1ms);
  ASSERT_EQ(rig.order(), Order{1});
  rig.bus->give_up_readings(3);
  rig.world.run_for(1us);
  ASSERT_TRUE(rig.ended(3));
  EXPECT_EQ(rig.ends[3].front().result.error().reason, Reason::superseded);
  rig.run_until(next + WatchRig::period / 2);
  EXPECT_EQ(rig.order(), (Order{1, 2}));
  EXPECT_EQ(rig.ends.size(), 2U);
}

TEST(RtuBusWatch, OfTwoForOneNodeTheSecondIsReadOnce) {
  WatchRig rig(1);
  rig.watch(1, 100ms);
  rig.world.run_for(150ms);
  rig.watch(1, 10ms);
  rig.world.run_for(20ms);
  ASSERT_EQ(rig.ends[1].size(), 1U);
  ASSERT_TRUE(rig.ends[1].front().result && *rig.ends[1].front().result);
  EXPECT_EQ((*rig.ends[1].front().result)->registers.front(), WatchRig::value_of(1));
  EXPECT_EQ(rig.line->wire().size(), 3U);
  rig.world.run_for(500ms);
  EXPECT_EQ(rig.line->wire().size(), 8U) << "the first goes on at its period";
  EXPECT_EQ(rig.ends[1].size(), 1U);
}

TEST(RtuBusWatch, APlainReadingThatJoinsItEndsIt) {
  for (const bool plain_first : {false, true}) {
    WatchRig rig(2);
    rig.read("busy", 2, TransactionClass::idle_state);
    if (plain_first) rig.read("plain", 1, TransactionClass::parameters);
    rig.watch(1);
    if (!plain_first) rig.read("plain", 1, TransactionClass::parameters);
    rig.world.run_for(1s);
    EXPECT_EQ(rig.order(), (Order{2, 1}));
    ASSERT_EQ(rig.results["plain"].size(), 1U);
    ASSERT_TRUE(rig.results["plain"].front());
    EXPECT_EQ(rig.results["plain"].front()->registers.front(), WatchRig::value_of(1));
    ASSERT_EQ(rig.ends[1].size(), 1U);
    EXPECT_EQ((*rig.ends[1].front().result)->sent_at, rig.results["plain"].front()->sent_at);
  }
}

/// When its next reading is due, a plain one of the same waits: they are one.
TEST(RtuBusWatch, JoinedByAPlainReadingThatWaitedBeforeItsTurn) {
  WatchRig rig(2);
  rig.watch(1, 100ms);
  rig.world.run_for(99ms);
  rig.read("busy", 2, TransactionClass::idle_state, 0x0003, 16);
  rig.read("plain", 1, TransactionClass::idle_state);
  rig.world.run_for(500ms);
  EXPECT_EQ(rig.order(), (Order{1, 2, 1}));
  EXPECT_EQ(rig.results["plain"].size(), 1U);
  EXPECT_EQ(rig.ends[1].size(), 1U);
}

TEST(RtuBusWatch, APlainReadingOfAnAxisAtRestIsTheLastOfARound) {
  WatchRig rig;
  const auto next = rig.settle();
  rig.run_until(next + 1ms);
  rig.read("plain", 4, TransactionClass::idle_state, 0x0003, 2);
  rig.run_until(next + WatchRig::period / 2);
  EXPECT_EQ(rig.order(), (Order{1, 2, 3, 4, 4}));
  ASSERT_EQ(rig.results["plain"].size(), 1U);
  ASSERT_TRUE(rig.results["plain"].front());
  EXPECT_EQ(rig.results["plain"].front()->registers.size(), 2U);
  EXPECT_EQ(rig.told_of(2).front().at, rig.line->wire().back().end) << "one round";
  rig.expect_told_as_sent();
}

TEST(RtuBusWatch, EachReadingIsCounted) {
  WatchRig rig;
  const auto next = rig.settle();
  const auto before = rig.bus->counters().transactions;
  rig.run_until(next);
  ASSERT_TRUE(rig.run_until_asked(2));
  const auto waiting = [&] {
    return rig.bus->statistics().classes().at(static_cast<std::size_t>(TransactionClass::idle_state)).waiting;
  };
  EXPECT_EQ(waiting(), 2U) << "of the round all but the first";
  EXPECT_FALSE(rig.bus->idle());
  rig.run_until(next + 5 * WatchRig::period / 2);
  EXPECT_EQ(waiting(), 0U);
  EXPECT_TRUE(rig.bus->idle());
  EXPECT_EQ(rig.line->wire().size(), 12U);
  EXPECT_EQ(rig.bus->counters().transactions - before, 12U);
  for (std::uint8_t node = 1; node <= 4; ++node)
    EXPECT_EQ(rig.bus->statistics().nodes().at(node).replies, 6U) << int{node};
  EXPECT_EQ(rig.bus->counters().dropped_superseded, 0U);
}

}  // namespace
}  // namespace axisd::modbus_rtu
