// Readings that end commands, beside the starts of others.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bus_rig.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using test::BusRig;

/// So many turns to start begin, one after another.
void take_turns(BusRig& rig, int count) {
  const auto one = [](BusRig& of) -> Task<> {
    const auto turn = of.bus->start_turns()->announce();
    co_await of.bus->start_turns()->take(turn);
  };
  for (int i = 0; i < count; ++i) spawn(rig.world.executor(), one(rig), "turn");
  rig.world.run_for(1us);
}

/// A turn for so many starts, which lasts.
void keep_turn(BusRig& rig, int starts) {
  const auto one = [](BusRig& of, int count) -> Task<> {
    const auto turn = of.bus->start_turns()->announce(count);
    co_await of.bus->start_turns()->take(turn);
    co_await sleep_until(of.world.executor(), of.world.clock(), of.world.now() + 1s);
  };
  spawn(rig.world.executor(), one(rig, starts), "turn");
  rig.world.run_for(1us);
}

/// As part of a start.
TransactionOptions guarded(const std::shared_ptr<AxisGate>& gate) {
  return {.transaction_class = TransactionClass::motion, .guard = {.gate = gate, .epoch = gate->epoch()}};
}

Request trigger_of(std::uint8_t node) {
  return {.node = node, .function = Function::write_single_register, .address = 0x0027, .values = {5}};
}

/// Whoever waits for the end of a motion goes before the starts of others, as long as these can wait. What
/// no gate guards cannot: it is read for a stop, or for a group.
TEST(RtuBus, AnAwaitedReadingGoesBeforeAStartThatCanWait) {
  enum class Start : std::uint8_t {
    unbounded,
    in_good_time,
    short_of_time,
    of_a_group,
    in_the_turn_of_a_group,
    unguarded,
  };
  for (const auto start : {Start::unbounded, Start::in_good_time, Start::short_of_time, Start::of_a_group,
                           Start::in_the_turn_of_a_group, Start::unguarded}) {
    SCOPED_TRACE(std::to_underlying(start));
    BusRig rig;
    take_turns(rig, 2);
    if (start == Start::in_the_turn_of_a_group) keep_turn(rig, 2);
    auto motion = guarded(std::make_shared<AxisGate>());
    const auto now = rig.world.now();
    if (start == Start::in_good_time) motion.guard.not_after = now + 150ms;
    if (start == Start::short_of_time) motion.guard.not_after = now + 40ms;
    if (start == Start::of_a_group) motion.guard.with = std::make_shared<std::vector<MotionGuard>>();
    if (start == Start::unguarded) motion.guard = {};
    rig.transact("under way", {.node = 2, .address = 0x0003, .count = 1}, {});
    rig.world.run_for(1ms);
    rig.transact("start", trigger_of(1), motion);
    rig.transact("usual", {.node = 2, .address = 0x0004, .count = 1},
                 {.transaction_class = TransactionClass::moving_state});
    rig.transact("awaited", {.node = 2, .address = 0x0005, .count = 1},
                 {.transaction_class = TransactionClass::moving_state, .awaited_from = now + 1ms});
    rig.transact("not yet", {.node = 2, .address = 0x0006, .count = 1},
                 {.transaction_class = TransactionClass::moving_state, .awaited_from = now + 10s});
    rig.world.run_for(200ms);
    std::vector<std::uint16_t> order;
    for (const auto& entry : rig.line->wire()) order.push_back(entry.address());
    const bool first = start == Start::unbounded || start == Start::in_good_time;
    EXPECT_EQ(order, first ? (std::vector<std::uint16_t>{0x0003, 0x0004, 0x0005, 0x0027, 0x0006})
                           : (std::vector<std::uint16_t>{0x0003, 0x0027, 0x0004, 0x0005, 0x0006}));
  }
}

/// All that waits behind a start comes later, too: nothing goes before it where one of that cannot wait.
TEST(RtuBus, AStartWaitsForNoReadingBeforeSomethingElseThatCannot) {
  enum class Behind : std::uint8_t { start, reading, member_of_a_group };
  for (const auto behind : {Behind::start, Behind::reading, Behind::member_of_a_group}) {
    SCOPED_TRACE(std::to_underlying(behind));
    BusRig rig;
    take_turns(rig, 2);
    auto second = guarded(std::make_shared<AxisGate>());
    if (behind == Behind::reading) second.guard = {};
    if (behind == Behind::member_of_a_group) second.guard.with = std::make_shared<std::vector<MotionGuard>>();
    rig.transact("under way", {.node = 2, .address = 0x0003, .count = 1}, {});
    rig.world.run_for(1ms);
    rig.transact("start", trigger_of(1), guarded(std::make_shared<AxisGate>()));
    rig.transact("behind it", {.node = 1, .address = 0x0007, .count = 1}, second);
    rig.transact("awaited", {.node = 2, .address = 0x0005, .count = 1},
                 {.transaction_class = TransactionClass::moving_state, .awaited_from = rig.world.now()});
    rig.world.run_for(200ms);
    std::vector<std::uint16_t> order;
    for (const auto& entry : rig.line->wire()) order.push_back(entry.address());
    EXPECT_EQ(order, behind == Behind::start ? (std::vector<std::uint16_t>{0x0003, 0x0005, 0x0027, 0x0007})
                                             : (std::vector<std::uint16_t>{0x0003, 0x0027, 0x0007, 0x0005}));
  }
}

/// What goes first may be answered as late as its node may: also the reading that is awaited longest, where
/// another one came before it.
TEST(RtuBus, AStartWaitsForNoReadingThatMayTakeAllOfItsTime) {
  for (const bool behind_another : {false, true})
    for (const auto turnaround : {20ms, 120ms}) {
      SCOPED_TRACE(testing::Message() << turnaround.count() << (behind_another ? ", behind another" : ""));
      BusRig rig;
      rig.bus->set_turnaround_max(2, turnaround);
      take_turns(rig, 2);
      auto motion = guarded(std::make_shared<AxisGate>());
      motion.guard.not_after = rig.world.now() + 100ms;
      rig.transact("under way", {.node = 1, .address = 0x0003, .count = 1}, {});
      rig.world.run_for(1ms);
      rig.transact("start", trigger_of(1), motion);
      if (behind_another)
        rig.transact("usual", {.node = 3, .address = 0x0004, .count = 1},
                     {.transaction_class = TransactionClass::moving_state});
      rig.transact("awaited", {.node = 2, .address = 0x0005, .count = 1},
                   {.transaction_class = TransactionClass::moving_state, .awaited_from = rig.world.now()});
      rig.world.run_for(300ms);
      ASSERT_GE(rig.line->wire().size(), 3U);
      EXPECT_EQ(rig.line->wire().at(1).address(), turnaround < 100ms ? 0x0005 : 0x0027);
    }
}

/// One reading for each turn, and at most as many as the published start counts where turns were spared.
TEST(RtuBus, AStartGivesWayToNoMoreThanItsShare) {
  for (const auto& [turns, first] :
       {std::pair{0, 0}, {1, 1}, {3, 3}, {50, static_cast<int>(most_that_go_first)}}) {
    SCOPED_TRACE(turns);
    BusRig rig;
    take_turns(rig, turns);
    rig.transact("under way", {.node = 2, .address = 0x0003, .count = 1}, {});
    rig.world.run_for(1ms);
    rig.transact("start", trigger_of(1), guarded(std::make_shared<AxisGate>()));
    for (std::uint16_t i = 0; i < 10; ++i)
      rig.transact("awaited" + std::to_string(i),
                   {.node = 2, .address = static_cast<std::uint16_t>(4 + i), .count = 1},
                   {.transaction_class = TransactionClass::moving_state, .awaited_from = rig.world.now()});
    rig.world.run_for(300ms);
    const auto& wire = rig.line->wire();
    const auto start =
        std::ranges::find_if(wire, [](const auto& entry) { return entry.address() == 0x0027; });
    ASSERT_NE(start, wire.end());
    EXPECT_EQ(start - wire.begin() - 1, first);
    EXPECT_EQ(wire.size(), 12U);
  }
}

/// Stops that are repeated in vain wait among the readings, and count as they do.
TEST(RtuBus, AStartGivesWayToNoMorePatientStopsThanItsShare) {
  BusRig rig;
  take_turns(rig, 1);
  rig.transact("under way", {.node = 2, .address = 0x0003, .count = 1}, {});
  rig.world.run_for(1ms);
  rig.transact("start", trigger_of(1), guarded(std::make_shared<AxisGate>()));
  for (const std::uint16_t kind : {0, 1})
    rig.transact(
        "stop" + std::to_string(kind),
        {.node = 2, .function = Function::write_single_register, .address = 0x0028, .values = {kind}},
        {.transaction_class = TransactionClass::stop, .patient = true});
  rig.transact("awaited", {.node = 2, .address = 0x0005, .count = 1},
               {.transaction_class = TransactionClass::moving_state, .awaited_from = rig.world.now()});
  rig.world.run_for(200ms);
  std::vector<std::uint16_t> order;
  for (const auto& entry : rig.line->wire()) order.push_back(entry.address());
  EXPECT_EQ(order, (std::vector<std::uint16_t>{0x0003, 0x0028, 0x0027, 0x0028, 0x0005}));
}

}  // namespace
}  // namespace axisd::modbus_rtu
