#include "buses/modbus_rtu/transaction_queue.hpp"

#include <gtest/gtest.h>

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using Class = TransactionClass;

TransactionPtr read_of(std::uint16_t address, Class transaction_class, TimePoint deadline = TimePoint::max(),
                       std::uint8_t node = 1) {
  auto transaction = std::make_unique<Transaction>();
  transaction->transaction_class = transaction_class;
  transaction->exchange.request = {
      .node = node, .function = Function::read_holding_registers, .address = address, .count = 2};
  transaction->exchange.frame = *encode(transaction->exchange.request);
  transaction->exchange.deadline = deadline;
  return transaction;
}

std::vector<std::uint16_t> drain(TransactionQueue& queue) {
  std::vector<std::uint16_t> order;
  while (auto transaction = queue.pop()) order.push_back(transaction->exchange.request.address);
  return order;
}

TEST(TransactionQueue, ClassesInStrictOrder) {
  TransactionQueue queue(100);
  std::uint16_t address = 10;
  for (const auto c :
       {Class::scan, Class::parameters, Class::idle_state, Class::moving_state, Class::motion, Class::stop})
    queue.push(read_of(address--, c));
  EXPECT_EQ(queue.top_class(), Class::stop);
  EXPECT_EQ(drain(queue), (std::vector<std::uint16_t>{5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(queue.top_class(), std::nullopt);
}

TEST(TransactionQueue, WhatIsBelowTheLowestClassIsNotGivenOut) {
  TransactionQueue queue(1);  // each pop would be reserved for a lower class
  queue.push(read_of(1, Class::idle_state));
  queue.push(read_of(2, Class::motion));
  queue.push(read_of(3, Class::motion));
  for (const std::uint16_t address : {2, 3}) {
    const auto next = queue.pop(Class::motion);
    ASSERT_NE(next, nullptr);
    EXPECT_EQ(next->exchange.request.address, address);
  }
  EXPECT_EQ(queue.pop(Class::motion), nullptr);
  EXPECT_EQ(drain(queue), (std::vector<std::uint16_t>{1}));
}

TEST(TransactionQueue, EarliestDeadlineThenArrival) {
  TransactionQueue queue;
  const TimePoint now{};
  queue.push(read_of(1, Class::parameters));
  queue.push(read_of(2, Class::parameters, now + 2s));
  queue.push(read_of(3, Class::parameters, now + 1s));
  queue.push(read_of(4, Class::parameters, now + 1s));
  EXPECT_EQ(queue.next_expiry(), now + 1s);
  EXPECT_EQ(drain(queue), (std::vector<std::uint16_t>{3, 4, 2, 1}));
}

TransactionPtr awaited_read(std::uint16_t address, TimePoint from, std::uint8_t node = 1,
                            Class of = Class::moving_state) {
  auto reading = read_of(address, of, TimePoint::max(), node);
  reading->awaited_from = from;
  return reading;
}

TEST(TransactionQueue, AnAwaitedReadingGoesBeforeMotionThatCanWait) {
  TransactionQueue queue;
  const TimePoint now{10s};
  const auto pops = [&](std::optional<TimePoint> awaited_by) {
    return queue.pop(awaited_by)->exchange.request.address;
  };
  queue.push(read_of(1, Class::moving_state));
  queue.push(awaited_read(2, now - 2ms, 2));
  queue.push(awaited_read(3, now + 1ms, 3));
  queue.push(awaited_read(4, now - 3ms, 4, Class::idle_state));
  queue.push(read_of(5, Class::motion));
  queue.push(read_of(6, Class::motion));
  EXPECT_EQ(pops({}), 5) << "it cannot wait";
  EXPECT_EQ(pops(now - 3ms), 6) << "nothing is awaited yet";
  queue.push(read_of(7, Class::motion));
  auto first = queue.pop(now);
  EXPECT_EQ(first->exchange.request.address, 2) << "before what came first";
  EXPECT_TRUE(first->reserved) << "motion does not take its place again";
  queue.put_back(std::move(first));
  queue.push(read_of(8, Class::stop));
  EXPECT_EQ(pops(now), 8) << "before everything";
  EXPECT_EQ(pops(now), 1) << "the other one has had its chance to pass it";
  EXPECT_EQ(pops(now), 2);
  EXPECT_EQ(pops(now), 7) << "the other is awaited later";
  EXPECT_EQ(drain(queue), (std::vector<std::uint16_t>{3, 4}));
}

TEST(TransactionQueue, OfAwaitedReadingsTheOneThatIsAwaitedLongestGoesFirst) {
  TransactionQueue queue;
  const TimePoint now{10s};
  queue.push(read_of(10, Class::motion));
  for (const std::uint8_t node : {2, 3, 4}) queue.push(awaited_read(node, now - node * 1ms, node));
  std::vector<std::uint16_t> order;
  for (int i = 0; i < 4; ++i) order.push_back(queue.pop(now)->exchange.request.address);
  EXPECT_EQ(order, (std::vector<std::uint16_t>{4, 3, 2, 10}));
}

/// However many are awaited, again and again: of each other node one, whether it waited before or came later.
TEST(TransactionQueue, AReadingIsPassedOnceByEachNode) {
  for (const bool waits_already : {false, true}) {
    TransactionQueue queue;
    TimePoint now{10s};
    std::uint16_t address = 100;
    if (waits_already) queue.push(read_of(99, Class::moving_state, TimePoint::max(), 2));
    queue.push(awaited_read(1, now + 10s));
    int before = 0;
    for (bool seen = false; !seen; now += 1ms) {
      for (const std::uint8_t node : {2, 3, 4}) queue.push(awaited_read(++address, now, node));
      queue.push(read_of(++address, Class::motion));
      const auto next = queue.pop(now);
      seen = next->exchange.request.address == 1;
      before += seen ? 0 : 1;
      ASSERT_LE(before, 3);
    }
    EXPECT_EQ(before, 3);
  }
}

/// What is awaited takes nothing from those below: one of eight is theirs all the same.
TEST(TransactionQueue, AwaitedReadingsKeepTheReservation) {
  TransactionQueue queue;
  const TimePoint now{10s};
  queue.push(read_of(1, Class::idle_state));
  queue.push(read_of(2, Class::motion));
  for (std::uint16_t i = 0; i < 20; ++i) queue.push(awaited_read(100 + i, now));
  int before = 0;
  while (queue.pop(now)->exchange.request.address != 1) ++before;
  EXPECT_EQ(before, TransactionQueue::default_reservation - 1);
}

TEST(TransactionQueue, EqualReadsMergeAndBothAreTold) {
  TransactionQueue queue;
  int told = 0;
  auto low = read_of(1, Class::parameters, TimePoint{} + 1s);
  auto high = read_of(1, Class::moving_state, TimePoint{} + 2s);
  for (auto* each : {&low, &high}) (*each)->on_end.emplace_back([&](const auto&, const auto&) { ++told; });
  queue.push(std::move(low));
  queue.push(std::move(high));
  queue.push(read_of(1, Class::parameters, TimePoint::max(), 2));  // another node
  ASSERT_EQ(queue.size(), 2U);
  const auto merged = queue.pop();
  EXPECT_EQ(merged->transaction_class, Class::moving_state);
  EXPECT_EQ(merged->exchange.deadline, TimePoint{} + 2s);
  for (const auto& tell : merged->on_end) tell(*merged, {});
  EXPECT_EQ(told, 2);
}

TEST(TransactionQueue, WritesAndGuardedReadsNeverMerge) {
  TransactionQueue queue;
  for (int i = 0; i < 2; ++i) {
    auto write = read_of(1, Class::motion);
    write->exchange.request.function = Function::write_single_register;
    queue.push(std::move(write));
    auto guarded = read_of(2, Class::motion);
    guarded->exchange.guard.gate = std::make_shared<AxisGate>();
    queue.push(std::move(guarded));
  }
  EXPECT_EQ(queue.size(), 4U);
}

/// Of one axis: what is owed to its silent node, and what is asked for meanwhile.
TEST(TransactionQueue, EqualStopsMergeAndBothAreTold) {
  TransactionQueue queue;
  int told = 0;
  const auto stop_of = [&](std::uint8_t node, std::uint16_t value) {
    auto stop = read_of(0x28, Class::stop, TimePoint::max(), node);
    stop->exchange.request = {
        .node = node, .function = Function::write_single_register, .address = 0x28, .values = {value}};
    stop->exchange.frame = *encode(stop->exchange.request);
    stop->on_end.emplace_back([&](const auto&, const auto&) { ++told; });
    return stop;
  };
  auto owed = stop_of(1, 0);
  owed->patient = owed->doubtful = true;
  queue.push(std::move(owed));
  queue.push(read_of(7, Class::moving_state));
  queue.push(stop_of(1, 0));
  queue.push(stop_of(2, 0));
  queue.push(stop_of(1, 1));  // a quick stop
  ASSERT_EQ(queue.size(), 4U);
  EXPECT_EQ(queue.top_class(), Class::stop);
  const auto merged = queue.pop();
  EXPECT_EQ(merged->exchange.request.node, 1);
  EXPECT_EQ(merged->exchange.request.values.front(), 0);
  EXPECT_FALSE(merged->patient || merged->doubtful) << "as urgent as the more urgent one";
  for (const auto& tell : merged->on_end) tell(*merged, {});
  EXPECT_EQ(told, 2);
}

TEST(TransactionQueue, EveryEighthComesFromBelowButNeverBeforeAStop) {
  TransactionQueue queue(8);
  queue.push(read_of(100, Class::scan));
  queue.push(read_of(101, Class::parameters));
  int until_lower = 0;
  for (std::uint16_t i = 0; i < 16; ++i) queue.push(read_of(i, Class::moving_state));
  while (queue.pop()->exchange.request.address < 100) ++until_lower;
  EXPECT_EQ(until_lower, 7);
  int until_next = 0;
  while (queue.pop()->exchange.request.address < 100) ++until_next;
  EXPECT_EQ(until_next, 7) << "the lower classes take turns";

  TransactionQueue stops(2);
  stops.push(read_of(100, Class::scan));
  for (std::uint16_t i = 0; i < 10; ++i) stops.push(read_of(i, Class::stop));
  for (int i = 0; i < 10; ++i) EXPECT_LT(stops.pop()->exchange.request.address, 100);
}

TransactionPtr motion_of(std::uint16_t address, const std::shared_ptr<AxisGate>& gate,
                         TimePoint not_after = TimePoint::max(), std::uint8_t node = 1) {
  auto motion = read_of(address, Class::motion, TimePoint::max(), node);
  motion->exchange.guard = {.gate = gate, .epoch = gate->epoch(), .not_after = not_after};
  return motion;
}

TEST(TransactionQueue, TakesOutWhatCameTooLate) {
  TransactionQueue queue;
  const TimePoint now{10s};
  const auto gate = std::make_shared<AxisGate>();
  queue.push(read_of(1, Class::parameters, now - 1ns));
  queue.push(read_of(2, Class::parameters, now));
  queue.push(motion_of(3, gate, now - 2ns));
  queue.hold(read_of(4, Class::idle_state, now - 1s, 9));
  EXPECT_EQ(queue.next_expiry(), now - 1s);
  std::vector<std::uint16_t> expired;
  for (const auto& each : queue.take_expired(now)) expired.push_back(each->exchange.request.address);
  EXPECT_EQ(expired, (std::vector<std::uint16_t>{4, 3, 1}));
  EXPECT_EQ(queue.next_expiry(), now);
  EXPECT_EQ(drain(queue), std::vector<std::uint16_t>{2});
  EXPECT_EQ(queue.next_expiry(), TimePoint::max());
}

TEST(TransactionQueue, TakesOutWhatItsGateForbidsAndOnlyThat) {
  TransactionQueue queue;
  const auto gate = std::make_shared<AxisGate>();
  queue.push(motion_of(1, gate));
  queue.hold(motion_of(2, gate));
  gate->raise();
  queue.push(motion_of(3, gate));
  queue.push(read_of(4, Class::motion));
  EXPECT_EQ(queue.take_forbidden(*gate, TimePoint{}).size(), 2U);
  EXPECT_TRUE(queue.take_forbidden(*gate, TimePoint{}).empty());
  EXPECT_EQ(queue.size(), 2U);
  EXPECT_EQ(drain(queue), (std::vector<std::uint16_t>{3, 4}));
}

/// Whatever a purge looks at and finds forbidden it takes out: what it leaves it has not looked at.
TEST(TransactionQueue, APurgeLooksAtNothingThatWaitsForOthers) {
  TransactionQueue queue;
  constexpr int others = 1000;
  std::vector<std::shared_ptr<AxisGate>> gates;
  for (std::uint16_t i = 0; i < others; ++i) {
    gates.push_back(std::make_shared<AxisGate>());
    queue.push(motion_of(i, gates.back(), TimePoint::max(), static_cast<std::uint8_t>(2 + i % 200)));
    gates.back()->raise();
  }
  const auto own = std::make_shared<AxisGate>();
  queue.push(motion_of(others, own));
  own->raise();
  EXPECT_EQ(queue.take_forbidden(*own, TimePoint{}).size(), 1U);
  EXPECT_EQ(queue.size(), static_cast<std::size_t>(others));
}

TEST(TransactionQueue, WhatIsHeldWaitsForItsNodeAndIsHastenedWithIt) {
  TransactionQueue queue;
  for (const std::uint8_t node : {7, 8}) queue.hold(read_of(node, Class::idle_state, TimePoint::max(), node));
  queue.push(read_of(1, Class::moving_state));
  EXPECT_EQ(queue.held_nodes(), (std::vector<std::uint8_t>{7, 8}));
  queue.hasten(8, Class::motion);
  EXPECT_EQ(queue.size(Class::motion), 0U);
  queue.release(8, {});
  queue.release(9, {});
  EXPECT_EQ(queue.held_nodes(), std::vector<std::uint8_t>{7});
  EXPECT_EQ(drain(queue), (std::vector<std::uint16_t>{8, 1}));
  EXPECT_EQ(queue.take_all().size(), 1U);
  EXPECT_EQ(queue.size(), 0U);
  EXPECT_TRUE(queue.held_nodes().empty());
}

TEST(TransactionQueue, ReadsOfOneNodeAreTakenOutDownToAClassHeldOrNot) {
  TransactionQueue queue;
  queue.hold(read_of(1, Class::idle_state));
  queue.push(read_of(2, Class::motion));
  queue.push(read_of(3, Class::parameters));
  queue.hold(read_of(4, Class::parameters));
  queue.hold(read_of(5, Class::idle_state, TimePoint::max(), 2));
  auto write = read_of(6, Class::motion);
  write->exchange.request.function = Function::write_single_register;
  queue.push(std::move(write));
  EXPECT_EQ(queue.take_reads(1, Class::idle_state).size(), 2U);
  EXPECT_TRUE(queue.take_reads(1, Class::idle_state).empty());
  EXPECT_TRUE(queue.take_reads(3, Class::idle_state).empty());
  EXPECT_EQ(queue.held_nodes(), (std::vector<std::uint8_t>{1, 2}));
  queue.release(1, {});
  EXPECT_EQ(drain(queue), (std::vector<std::uint16_t>{6, 3, 4}));
}

TransactionPtr of_others(std::uint16_t address, Class of) {
  auto reading = read_of(address, of);
  reading->of_others = true;
  return reading;
}

/// What somebody else reads of a drive is neither hurried nor ended because its axis starts or stops; what
/// the axis reads to connect is.
TEST(TransactionQueue, WhatOthersAskOfANodeIsNotHastened) {
  TransactionQueue queue;
  queue.push(of_others(1, Class::parameters));
  queue.push(of_others(2, Class::scan));
  queue.push(read_of(3, Class::parameters));
  queue.hold(of_others(4, Class::parameters));
  queue.hold(read_of(5, Class::parameters));
  EXPECT_TRUE(queue.take_reads(1, Class::idle_state).empty()) << "nobody is in a hurry yet";
  queue.hasten(1, Class::moving_state);
  EXPECT_EQ(queue.size(Class::moving_state), 1U);
  EXPECT_EQ(queue.size(Class::parameters), 1U);
  EXPECT_EQ(queue.size(Class::scan), 1U);
  std::vector<std::uint16_t> taken;
  for (const auto& read : queue.take_reads(1, Class::idle_state))
    taken.push_back(read->exchange.request.address);
  EXPECT_EQ(taken, (std::vector<std::uint16_t>{3, 5}));
  queue.release(1, {});
  EXPECT_EQ(drain(queue), (std::vector<std::uint16_t>{1, 4, 2}));
}

/// Else it could be ended no more, or take the others' with it.
TEST(TransactionQueue, NoReadingOfAnAxisJoinsThatOfOthers) {
  TransactionQueue queue;
  queue.push(of_others(1, Class::parameters));
  queue.push(of_others(1, Class::parameters));  // joins the first one
  queue.push(read_of(1, Class::idle_state));
  EXPECT_EQ(queue.size(), 2U);
  EXPECT_EQ(queue.take_reads(1, Class::idle_state).size(), 1U);
  EXPECT_EQ(queue.size(), 1U);
}

TEST(TransactionQueue, PutBackKeepsItsPlace) {
  TransactionQueue queue;
  queue.push(read_of(1, Class::parameters));
  queue.push(read_of(2, Class::parameters));
  queue.put_back(queue.pop());
  EXPECT_EQ(drain(queue), (std::vector<std::uint16_t>{1, 2}));
}

}  // namespace
}  // namespace axisd::modbus_rtu
