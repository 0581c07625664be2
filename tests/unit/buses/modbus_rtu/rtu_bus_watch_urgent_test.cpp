// What is more urgent than a round of readings that the bus repeats by itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "watch_rig.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using test::WatchRig;
using Order = std::vector<int>;

const Request halt{.node = 1, .function = Function::write_single_register, .address = 0x0028, .values = {0}};

/// Whatever is more urgent goes out behind what is under way; nothing of the round is lost, read twice or
/// told out of order.
TEST(RtuBusWatchUrgent, GoesOutBehindWhatIsUnderWay) {
  for (const auto of : {TransactionClass::stop, TransactionClass::motion, TransactionClass::moving_state})
    for (Duration offset{}; offset < 30ms; offset += 331us) {
      SCOPED_TRACE(testing::Message() << to_string(of) << " after " << offset.count() << " ns");
      WatchRig rig(6);
      const auto next = rig.settle();
      rig.run_until(next + offset);
      const auto asked = rig.world.now();
      if (of == TransactionClass::moving_state)
        rig.read("urgent", 6, of, 0x0003, 2);
      else
        rig.transact("urgent", halt, {.transaction_class = of});
      rig.run_until(next + WatchRig::period / 2);
      ASSERT_EQ(rig.results["urgent"].size(), 1U);
      EXPECT_TRUE(rig.results["urgent"].front());
      const auto& wire = rig.line->wire();
      EXPECT_EQ(wire.size(), 7U);
      const auto urgent =
          std::ranges::find_if(wire, [](const auto& one) { return one.address() != WatchRig::watched; });
      ASSERT_NE(urgent, wire.end());
      const auto between = std::ranges::count_if(
          wire, [&](const auto& one) { return one.begin > asked && one.begin < urgent->begin; });
      EXPECT_EQ(between, 0);
      if (urgent != wire.begin() && std::prev(urgent)->end >= asked)
        EXPECT_EQ(urgent->begin, std::prev(urgent)->end + silence(rig.bus->settings().serial()));
      auto rest = rig.order();
      rest.erase(rest.begin() + (urgent - wire.begin()));
      EXPECT_EQ(rest, (Order{1, 2, 3, 4, 5, 6}));
      rig.expect_silences();
      rig.expect_told_as_sent();
      EXPECT_TRUE(rig.ends.empty());
    }
}

/// What is asked for by others comes at the latest with the queue's reservation.
TEST(RtuBusWatchUrgent, ParametersAreNotStarvedByRounds) {
  for (Duration offset{}; offset < 45ms; offset += 331us) {
    SCOPED_TRACE(offset.count());
    WatchRig rig(8);
    const auto next = rig.settle();
    rig.run_until(next + offset);
    const auto asked = rig.world.now();
    rig.read("parameters", 1, TransactionClass::parameters, 0x0003, 2);
    rig.run_until(next + WatchRig::period / 2);
    ASSERT_EQ(rig.results["parameters"].size(), 1U);
    EXPECT_TRUE(rig.results["parameters"].front());
    const auto& wire = rig.line->wire();
    EXPECT_EQ(wire.size(), 9U);
    const auto parameters =
        std::ranges::find_if(wire, [](const auto& one) { return one.address() != WatchRig::watched; });
    ASSERT_NE(parameters, wire.end());
    EXPECT_LE(std::ranges::count_if(
                  wire, [&](const auto& one) { return one.begin > asked && one.begin < parameters->begin; }),
              TransactionQueue::default_reservation);
    auto rest = rig.order();
    rest.erase(rest.begin() + (parameters - wire.begin()));
    EXPECT_EQ(rest, (Order{1, 2, 3, 4, 5, 6, 7, 8}));
    rig.expect_told_as_sent();
  }
}

TEST(RtuBusWatchUrgent, AStopCutsTheWaitForASilentNodeOfARound) {
  WatchRig rig;
  const auto next = rig.settle();
  rig.line->network().node(3)->set_power(false);
  rig.run_until(next);
  ASSERT_TRUE(rig.run_until_asked(3));
  const auto asked = rig.world.now();
  rig.transact("stop", halt, {.transaction_class = TransactionClass::stop});
  rig.run_until(next + WatchRig::period / 2);
  ASSERT_GE(rig.line->wire().size(), 5U);
  EXPECT_EQ(rig.order(), (Order{1, 2, 3, 1, 4}));
  EXPECT_EQ(rig.line->wire()[2].status, ExchangeStatus::cut);
  EXPECT_LE(rig.line->wire()[3].begin - asked, 25ms);
  ASSERT_TRUE(rig.ended(3));
  EXPECT_EQ(rig.ends[3].front().result.error().reason, Reason::no_reply);
  EXPECT_EQ(rig.ends.size(), 1U);
}

TEST(RtuBusWatchUrgent, HastenedItGoesFirstAndEndsWithItsAnswer) {
  for (Duration offset = 6ms; offset < 12ms; offset += 331us) {
    SCOPED_TRACE(offset.count());
    WatchRig rig;
    const auto next = rig.settle();
    rig.run_until(next + offset);
    ASSERT_EQ(rig.entry(4), nullptr);
    const auto before = rig.line->wire().size();
    rig.bus->hasten(4, TransactionClass::moving_state);
    rig.run_until(next + WatchRig::period / 2);
    const auto order = rig.order();
    ASSERT_EQ(order.size(), 4U);
    EXPECT_EQ(order.at(before), 4);
    ASSERT_TRUE(rig.ended(4));
    ASSERT_TRUE(rig.ends[4].front().result && *rig.ends[4].front().result);
    EXPECT_EQ(rig.ends[4].front().at, rig.entry(4)->end);
    EXPECT_EQ(rig.ends.size(), 1U);
    EXPECT_EQ((std::set<int>{order.begin(), order.end()}), (std::set<int>{1, 2, 3, 4}));
    rig.expect_silences();
  }
}

}  // namespace
}  // namespace axisd::modbus_rtu
