#include "buses/modbus_rtu/quarantine.hpp"

#include <gtest/gtest.h>

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t one = 1, two = 2, three = 3;
constexpr auto short_wait = 30ms, long_wait = 213ms;
constexpr TimePoint start{10s};

/// Probes `node` in vain whenever it may be asked, until `end`; returns what that took of the line's time.
Duration probe(Quarantine& quarantine, std::initializer_list<std::uint8_t> nodes, TimePoint from,
               TimePoint end, Duration cost, Unanswered what = Unanswered::request) {
  Duration sum{};
  for (auto now = from; now < end;) {
    auto next = end;
    for (const auto node : nodes) {
      if (quarantine.ready_at(node) <= now) {
        now += cost;
        sum += cost;
        quarantine.silent(node, now, cost, what);
      }
      next = std::min(next, quarantine.ready_at(node));
    }
    now = std::max(now, next);
  }
  return sum;
}

/// Of all of the line's time, once the waits have grown.
double share(std::initializer_list<std::uint8_t> nodes, Duration cost) {
  Quarantine quarantine;
  const auto settled = start + 60s, end = settled + 600s;
  probe(quarantine, nodes, start, settled, cost);
  return static_cast<double>(probe(quarantine, nodes, settled, end, cost).count()) /
         static_cast<double>(Duration(600s).count());
}

TEST(Quarantine, OneRequestInVainIsEnoughForANodeThatNeverAnswered) {
  Quarantine quarantine;
  EXPECT_EQ(quarantine.ready_at(one), TimePoint{});
  quarantine.silent(one, start, short_wait, Unanswered::request);
  EXPECT_EQ(quarantine.ready_at(one), start + quarantine_first_hold);
  EXPECT_TRUE(quarantine.nodes().at(one).quarantined());
  EXPECT_EQ(quarantine.ready_at(two), TimePoint{}) << "others are not concerned";
}

TEST(Quarantine, ANodeThatAnsweredMayFailTwice) {
  Quarantine quarantine;
  quarantine.answered(one);
  for (int i = 1; i < quarantine_after; ++i) {
    quarantine.silent(one, start, short_wait, Unanswered::request);
    EXPECT_FALSE(quarantine.nodes().at(one).quarantined());
  }
  quarantine.silent(one, start, short_wait, Unanswered::request);
  EXPECT_TRUE(quarantine.nodes().at(one).quarantined());
  EXPECT_EQ(quarantine.nodes().at(one).entered, 1U);
  EXPECT_EQ(quarantine.nodes().at(one).since, start);
  EXPECT_EQ(quarantine.nodes().at(one).probes, 0U);
  quarantine.silent(one, start + 1s, short_wait, Unanswered::request);
  EXPECT_EQ(quarantine.nodes().at(one).entered, 1U);
  EXPECT_EQ(quarantine.nodes().at(one).since, start);
  EXPECT_EQ(quarantine.nodes().at(one).probes, 1U);
}

TEST(Quarantine, WaitsDoubleUpToTheShare) {
  Quarantine quarantine;
  auto now = start;
  std::vector<Duration> waits;
  for (int i = 0; i < 7; ++i) {
    quarantine.silent(one, now, short_wait, Unanswered::request);
    waits.push_back(quarantine.ready_at(one) - now);
    now = quarantine.ready_at(one);
  }
  const auto most = quarantine_share * short_wait;
  EXPECT_EQ(waits, (std::vector<Duration>{100ms, 200ms, 400ms, 800ms, most, most, most}));
}

TEST(Quarantine, AReplyEndsTheWaitAndFourOfThemTheSuspicion) {
  Quarantine quarantine;
  probe(quarantine, {one}, start, start + 10s, short_wait);
  quarantine.answered(one);
  EXPECT_EQ(quarantine.ready_at(one), TimePoint{});
  EXPECT_FALSE(quarantine.nodes().at(one).quarantined());
  quarantine.silent(one, start + 20s, short_wait, Unanswered::request);
  EXPECT_EQ(quarantine.ready_at(one), start + 20s + 2 * quarantine_first_hold)
      << "suspected, but not for long";
  for (int i = 0; i < quarantine_trust_after; ++i) quarantine.answered(one);
  quarantine.silent(one, start + 30s, short_wait, Unanswered::request);
  EXPECT_EQ(quarantine.ready_at(one), TimePoint{}) << "trusted: one failure is none";
}

TEST(Quarantine, StopsAloneDoNotPutANodeThere) {
  Quarantine quarantine;
  for (int i = 0; i < 10; ++i) quarantine.silent(one, start, short_wait, Unanswered::stop);
  EXPECT_EQ(quarantine.ready_at(one), TimePoint{});
}

TEST(Quarantine, AStopInVainPutsTheNextProbeOffOnceOnly) {
  Quarantine quarantine;
  probe(quarantine, {one}, start, start + 10s, short_wait);
  const auto hold = quarantine_share * short_wait;
  const auto now = start + 20s;
  quarantine.silent(one, now, short_wait, Unanswered::stop);
  EXPECT_EQ(quarantine.ready_at(one), now + hold);
  for (int i = 0; i < 20; ++i) quarantine.silent(one, now, short_wait, Unanswered::stop);
  EXPECT_EQ(quarantine.ready_at(one), now + 2 * hold) << "a node that is back is not to wait for all of them";
}

TEST(Quarantine, EachCostsTwoPercentOfTheLine) {
  EXPECT_LE(share({one}, short_wait), 0.02);
  EXPECT_LE(share({one, two, three}, short_wait), 0.06);
  EXPECT_GE(share({one}, short_wait), 0.018) << "they are probed all the same";
}

/// It may be turning its motor, and gets its stop as soon as it is there again.
TEST(Quarantine, ANodeThatIsOwedAStopIsProbedMoreOftenForAWhile) {
  Quarantine quarantine;
  probe(quarantine, {one}, start, start + 10s, short_wait, Unanswered::owed_stop);
  auto now = quarantine.ready_at(one);
  quarantine.silent(one, now, short_wait, Unanswered::owed_stop);
  EXPECT_EQ(quarantine.ready_at(one), now + quarantine_owed_share * short_wait);
  now = start + quarantine_owed_time + short_wait;
  quarantine.silent(one, now, short_wait, Unanswered::owed_stop);
  EXPECT_EQ(quarantine.ready_at(one), now + quarantine_share * short_wait) << "it is gone for good";
  quarantine.answered(one);
  now += 10s;
  for (int i = 0; i < 6; ++i) quarantine.silent(one, now, short_wait, Unanswered::owed_stop);
  EXPECT_EQ(quarantine.ready_at(one), now + 2 * quarantine_owed_share * short_wait) << "it was there since";
}

TEST(Quarantine, NodesThatAreOwedAStopShareWhatTheyMayCost) {
  /// Once the waits have grown.
  const auto part = [](std::initializer_list<std::uint8_t> nodes, Duration cost) {
    Quarantine quarantine;
    const auto settled = start + 10s, end = start + quarantine_owed_time;
    probe(quarantine, nodes, start, settled, cost, Unanswered::owed_stop);
    const auto sum = probe(quarantine, nodes, settled, end, cost, Unanswered::owed_stop);
    return static_cast<double>(sum.count()) / static_cast<double>((end - settled).count());
  };
  for (const auto cost : {short_wait, long_wait}) {
    EXPECT_LE(part({one}, cost), 1.0 / quarantine_owed_share) << cost.count();
    EXPECT_LE(part({one, two, three}, cost), 0.13) << cost.count() << ": few long waits, in a row";
    EXPECT_GE(part({one, two, three}, cost), 0.08) << cost.count();
  }
  EXPECT_LE(share({one}, short_wait), 0.02) << "others cost as little as ever";
}

/// Where a wait for a silent node takes long (turnaround_max 200 ms).
TEST(Quarantine, SlowNodesAreProbedMoreOftenAsLongAsTheLineCanBearIt) {
  EXPECT_LE(share({one}, long_wait), 0.04);
  EXPECT_GE(share({one}, long_wait), 0.035);
  EXPECT_LE(share({one, two, three}, long_wait), 0.06) << "several share it";
  Quarantine quarantine;
  probe(quarantine, {one}, start, start + 60s, long_wait);
  quarantine.silent(one, start + 100s, long_wait, Unanswered::request);
  EXPECT_EQ(quarantine.ready_at(one), start + 100s + quarantine_common_share * long_wait);
  Quarantine cheap;
  probe(cheap, {one}, start, start + 60s, 60ms);
  cheap.silent(one, start + 100s, 60ms, Unanswered::request);
  EXPECT_EQ(cheap.ready_at(one), start + 100s + quarantine_longest_hold);
}

TEST(Quarantine, ForgetsAllWithThePort) {
  Quarantine quarantine;
  quarantine.silent(one, start, short_wait, Unanswered::request);
  quarantine.forget();
  EXPECT_EQ(quarantine.ready_at(one), TimePoint{});
  EXPECT_FALSE(quarantine.nodes().at(one).quarantined());
  EXPECT_EQ(quarantine.nodes().at(one).entered, 1U) << "but for what was counted";
}

}  // namespace
}  // namespace axisd::modbus_rtu
