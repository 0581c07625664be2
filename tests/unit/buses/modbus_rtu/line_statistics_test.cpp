// What the bus counts, on a virtual line with simulated drives.
#include "buses/modbus_rtu/line_statistics.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/unit/buses/modbus_rtu/bus_rig.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using simulation::Fault;
using test::BusRig;

std::uint64_t sum(const LatencyHistogram& histogram) {
  return std::accumulate(histogram.counts().begin(), histogram.counts().end(), std::uint64_t{});
}

const ClassStatistics& parameters(const LineStatistics& statistics) {
  return statistics.classes().at(std::to_underlying(TransactionClass::parameters));
}

TEST(LineStatistics, CountsExchangesWithTheirLatencies) {
  BusRig rig;
  rig.read("a", 0, 1);
  rig.read("b", 0, 2);
  rig.read("c", 0, 1, 2);
  rig.world.run_for(1s);
  const auto statistics = rig.bus->statistics();
  const auto& of_class = parameters(statistics);
  EXPECT_EQ(of_class.sent, 3U);
  EXPECT_EQ(sum(of_class.queueing), 3U);
  EXPECT_EQ(sum(of_class.exchange), 3U);
  EXPECT_EQ(of_class.waiting, 0U);
  EXPECT_EQ(of_class.most_waiting, 2U);  // the first one went into the slot at once
  EXPECT_GT(of_class.queueing.longest(), of_class.exchange.longest());
  EXPECT_EQ(statistics.nodes().at(1).replies, 2U);
  EXPECT_EQ(statistics.nodes().at(2).replies, 1U);
  EXPECT_GT(statistics.nodes().at(1).longest_turnaround, 0ms);
  EXPECT_EQ(statistics.nodes().at(1).occupied + statistics.nodes().at(2).occupied,
            statistics.load().occupied());
  // Silence, request and reply are all there is.
  const auto wire = rig.line->wire();
  Duration occupied{};
  for (const auto& entry : wire) occupied += entry.end - entry.begin + silence(rig.bus->settings());
  EXPECT_EQ(statistics.load().occupied(), occupied);
}

TEST(LineStatistics, CountsTimeoutsRepeatsAndExceptions) {
  BusRig rig;
  rig.read("silent", 0, 1, 9);
  rig.world.run_for(1s);
  rig.read("again", 0, 2, 9);
  rig.world.run_for(1s);
  rig.read("same", 0, 2, 9);
  rig.world.run_for(7s);
  rig.read("none", 0x7000, 1);
  rig.world.run_for(1s);
  const auto statistics = rig.bus->statistics();
  const auto& silent = statistics.nodes().at(9);
  EXPECT_EQ(silent.replies, 0U);
  EXPECT_GE(silent.timeouts, 3U);
  const auto& drive = statistics.nodes().at(1);
  EXPECT_EQ(drive.exceptions.at(*rig.results.at("none").error().where.native_code), 1U);
  EXPECT_EQ(drive.repeats, 0U);
  const auto counters = rig.bus->counters();
  EXPECT_EQ(counters.timeouts, silent.timeouts);
  EXPECT_EQ(counters.transactions, 1U);
  EXPECT_EQ(counters.exceptions, 1U);
  const auto& ends = parameters(statistics).ends;
  EXPECT_EQ(ends.no_reply, silent.timeouts);
  EXPECT_EQ(ends.refused, 1U);
  EXPECT_EQ(ends.answered + ends.refused + ends.no_reply, parameters(statistics).sent);
}

TEST(LineStatistics, RepeatIsTheSameRequestAfterOneInVain) {
  LineStatistics statistics({}, TimePoint{});
  Transaction read;
  read.exchange.request = {.node = 1, .address = 3, .count = 10};
  const auto end = [&](ExchangeStatus status) { statistics.ended(read, {.status = status}); };
  end(ExchangeStatus::replied);
  end(ExchangeStatus::replied);
  EXPECT_EQ(statistics.nodes().at(1).repeats, 0U);
  end(ExchangeStatus::timeout);
  end(ExchangeStatus::corrupt);
  EXPECT_EQ(statistics.nodes().at(1).repeats, 1U);
  read.exchange.request.address = 4;
  end(ExchangeStatus::replied);
  EXPECT_EQ(statistics.nodes().at(1).repeats, 1U);
}

/// A read that has to tell late replies apart goes in between, and is not what was asked for.
TEST(LineStatistics, AReadThatTellsLateRepliesApartHidesNoRepeat) {
  BusRig rig;
  rig.read("sound", 0, 3);
  rig.world.run_for(1s);
  rig.line->network().faults().add({.kind = simulation::FaultKind::drop_reply});
  rig.read("lost", 0, 2);
  rig.world.run_for(1s);
  rig.read("again", 0, 2);
  rig.world.run_for(1s);
  const auto statistics = rig.bus->statistics();
  EXPECT_EQ(statistics.nodes().at(1).timeouts, 1U);
  EXPECT_EQ(statistics.nodes().at(1).replies, 3U);
  EXPECT_EQ(statistics.nodes().at(1).repeats, 1U);
}

/// What a silent node has to wait for of purpose says nothing of how soon its class has its turn.
TEST(LineStatistics, WaitingForTheNextProbeOfASilentNodeIsNotQueueing) {
  BusRig rig;
  for (int i = 0; i < 6; ++i) {
    rig.read("silent", 0, 1, 9);
    while (rig.results.erase("silent") == 0) rig.world.run_for(1ms);
  }
  rig.transact("stop",
               {.node = 9, .function = Function::write_single_register, .address = 0x0028, .values = {0}},
               {.transaction_class = TransactionClass::stop, .patient = true});
  rig.world.run_for(10s);
  const auto statistics = rig.bus->statistics();
  EXPECT_EQ(parameters(statistics).sent, 6U);
  EXPECT_LT(parameters(statistics).queueing.longest(), 50ms);
  const auto& stops = statistics.classes().at(std::to_underlying(TransactionClass::stop));
  EXPECT_EQ(stops.sent, 1U);
  EXPECT_LT(stops.queueing.longest(), 50ms);
}

/// Else each scan would leave a row for every address of the standard.
TEST(LineStatistics, AddressesWhereAScanHeardNobodyAreNoNodes) {
  BusRig rig;
  for (const std::uint8_t node : {1, 9})
    rig.transact("scan", {.node = node, .address = 0, .count = 1},
                 {.transaction_class = TransactionClass::scan});
  rig.world.run_for(1s);
  const auto statistics = rig.bus->statistics();
  EXPECT_EQ(statistics.classes().at(std::to_underlying(TransactionClass::scan)).sent, 2U);
  EXPECT_GT(statistics.load().occupied(), 20ms);
  EXPECT_NE(statistics.nodes().find(1), nullptr);
  EXPECT_EQ(statistics.nodes().find(9), nullptr);
}

TEST(LineStatistics, CountsDropsByCause) {
  LineStatistics statistics({}, TimePoint{});
  Transaction motion;
  motion.transaction_class = TransactionClass::motion;
  for (const auto verdict : {Verdict::expired, Verdict::superseded, Verdict::lease_lost, Verdict::send})
    statistics.ended(motion, {.status = ExchangeStatus::not_sent, .verdict = verdict});
  statistics.ended(motion, {.status = ExchangeStatus::unsupported});
  const auto& drops = statistics.classes().at(std::to_underlying(TransactionClass::motion)).drops;
  EXPECT_EQ(drops.expired, 1U);
  EXPECT_EQ(drops.superseded, 1U);
  EXPECT_EQ(drops.lease_lost, 1U);
  EXPECT_EQ(drops.port_lost, 1U);
  EXPECT_EQ(drops.unsupported, 1U);
  EXPECT_TRUE(statistics.nodes().empty());
  EXPECT_EQ(statistics.counters().dropped_expired, 1U);
  EXPECT_EQ(statistics.counters().dropped_superseded, 3U);
}

TEST(LineStatistics, TellsTheObserverOfWhatWasNeverSent) {
  test::VirtualWorld world;
  auto made = std::make_unique<test::VirtualLine>(world, LineSettings{.name = "a", .port = "sim"});
  RtuBus bus(world.executor(), world.clock(), LineSettings{.name = "a", .port = "sim"}, std::move(made));
  std::vector<ExchangeStatus> told;
  bus.start([&](const Transaction&, const ExchangeResult& result) { told.push_back(result.status); });
  world.run_for(10ms);
  auto ask = [](RtuBus& on, TransactionOptions options) -> Task<> {
    (void)co_await on.transact({.node = 1}, std::move(options));
  };
  spawn(world.executor(), ask(bus, {}), "first");
  spawn(world.executor(), ask(bus, {.deadline = world.now()}), "late");
  world.run_for(1s);
  EXPECT_EQ(told, (std::vector{ExchangeStatus::not_sent, ExchangeStatus::timeout}));
}

}  // namespace
}  // namespace axisd::modbus_rtu
