#include "buses/canopen/master.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "network.hpp"

namespace axisd::canopen {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using Kind = NodeEvent::Kind;

TEST(Master, AdoptsNodesAndSendsNothingByItself) {
  Network net;
  ASSERT_TRUE(net.master->add_node(5, 1500ms));
  EXPECT_FALSE(net.master->add_node(0));
  net.port->receive(0x705, Bytes{0x05});
  net.world.run_for(1s);
  EXPECT_EQ(net.master->nmt().status(5).state, NmtState::operational);
  EXPECT_TRUE(net.port->log.empty());
}

TEST(Master, NmtToOneNodeOnly) {
  Network net;
  EXPECT_TRUE(net.run(net.master->command(1, NmtCommand::start)));
  EXPECT_EQ(net.run(net.master->command(0, NmtCommand::start)).error().reason, Reason::invalid_argument);
  EXPECT_THAT(net.port->log, ElementsAre("000#0101"));
  net.port->next_status = can::SendStatus::port_down;
  EXPECT_FALSE(net.run(net.master->command(1, NmtCommand::start)));
}

TEST(Master, TellsRebootsFromRequestedResets) {
  Network net;
  ASSERT_TRUE(net.master->add_node(1));
  ASSERT_TRUE(net.run(net.master->command(1, NmtCommand::reset_node)));
  net.port->receive(0x701, Bytes{0});
  net.port->receive(0x701, Bytes{5});
  net.port->receive(0x701, Bytes{0});
  ASSERT_EQ(net.events.size(), 3U);
  EXPECT_TRUE(net.events[0].kind == Kind::booted && net.events[0].requested);
  EXPECT_EQ(net.events[1].kind, Kind::state_changed);
  EXPECT_TRUE(net.events[2].kind == Kind::booted && !net.events[2].requested);
  EXPECT_EQ(net.events[2].from, NmtState::operational);
  EXPECT_EQ(net.events[2].to, NmtState::pre_operational);
  net.port->next_status = can::SendStatus::expired;
  EXPECT_FALSE(net.run(net.master->command(1, NmtCommand::reset_node)));
  net.port->receive(0x701, Bytes{0});
  EXPECT_FALSE(net.events.back().requested);
}

TEST(Master, MissesAHeartbeatOnlyAfterTheFirst) {
  Network net;
  ASSERT_TRUE(net.master->add_node(1, 150ms));
  net.world.run_for(1s);
  EXPECT_TRUE(net.events.empty());
  for (int i = 0; i < 5; ++i) {
    net.port->receive(0x701, Bytes{5});
    net.world.run_for(100ms);
  }
  EXPECT_EQ(net.events.size(), 1U);
  net.world.run_for(49ms);
  EXPECT_EQ(net.events.size(), 1U);
  net.world.run_for(1ms);
  ASSERT_EQ(net.events.size(), 2U);
  EXPECT_EQ(net.events[1].kind, Kind::heartbeat_lost);
  EXPECT_EQ(net.master->nmt().status(1).state, NmtState::unknown);
  net.port->receive(0x701, Bytes{4});
  EXPECT_EQ(net.events.back().kind, Kind::heartbeat_again);
  net.port->set_link(can::InterfaceState::down);
  net.world.run_for(1s);
  EXPECT_EQ(net.events.size(), 3U);  // without a link silence says nothing
}

TEST(Master, KeepsEmergenciesUntilTheyAreReset) {
  Network net;
  ASSERT_TRUE(net.master->add_node(3));
  net.port->receive(0x083, Bytes{0x05, 0xFF, 0x01, 1, 2, 3, 4, 5});
  ASSERT_EQ(net.emergencies.size(), 1U);
  EXPECT_EQ(net.emergencies[0].code, 0xFF05);
  EXPECT_EQ(net.emergencies[0].error_register, 1);
  EXPECT_THAT(net.emergencies[0].vendor, ElementsAre(1, 2, 3, 4, 5));
  EXPECT_EQ(emergency_text(0xFF05), "device specific");
  EXPECT_EQ(emergency_text(0x3210), "voltage");
  EXPECT_EQ(emergency_text(0x8130), "communication");
  EXPECT_EQ(net.master->emergencies().active(3)->code, 0xFF05);
  net.port->receive(0x083, Bytes{0, 0, 0x01, 0, 0, 0, 0, 0});  // one of several is gone
  EXPECT_TRUE(net.master->emergencies().active(3));
  net.port->receive(0x083, Bytes{0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_FALSE(net.master->emergencies().active(3));
  for (int i = 0; i < 100; ++i)
    net.port->receive(0x083, Bytes{1, 0x81, 0, 0, 0, 0, 0, static_cast<std::uint8_t>(i)});
  EXPECT_EQ(net.master->emergencies().of(3).size(), 32U);
  EXPECT_EQ(net.master->emergencies().of(3).back().vendor[4], 99);
  EXPECT_EQ(net.master->emergencies().total(3), 103U);
  EXPECT_TRUE(net.master->emergencies().of(4).empty());
}

TEST(Master, CountsWhatConcernsNobody) {
  Network net;
  ASSERT_TRUE(net.master->add_node(1));
  net.port->receive(0x709, Bytes{5});
  net.port->receive(0x000, Bytes{1, 0});
  net.port->receive(0x7E5, Bytes{5});
  net.port->receive(0x181, Bytes{5});
  net.port->receive(0x701, Bytes{0x33});
  net.port->receive(0x081, Bytes{1});
  net.port->receive(0x582, SdoData{0x60});
  EXPECT_EQ(net.master->counters().foreign_node, 2U);
  EXPECT_EQ(net.master->counters().unknown_cob, 2U);
  EXPECT_EQ(net.master->counters().malformed, 2U);
  EXPECT_EQ(net.master->sdo().counters().unexpected_replies, 1U);
  EXPECT_THAT(net.master->foreign_nodes(), ElementsAre(9));
}

TEST(Master, SurvivesAFloodOfAnything) {
  Network net;
  ASSERT_TRUE(net.master->add_node(1, 100ms));
  std::mt19937 random(7);
  net.upload("read", 1, {0x1008, 0});
  for (int i = 0; i < 20000; ++i) {
    Bytes bytes(random() % 9);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    const auto id = random() % 4 == 0 ? 0x581U : static_cast<std::uint32_t>(random() % 0x800);
    net.port->receive(id, bytes, random() % 16 == 0);
    if (i % 64 == 0) net.world.run_for(1ms);
  }
  net.world.run_for(10s);
  EXPECT_TRUE(net.results.contains("read"));
  EXPECT_LE(net.master->emergencies().of(1).size(), 32U);
}

TEST(Master, Pdos) {
  Network net;
  std::vector<Bytes> received;
  const auto keep = [&](const can::ReceivedFrame& frame) {
    received.emplace_back(frame.frame.bytes().begin(), frame.frame.bytes().end());
  };
  ASSERT_TRUE(net.master->subscribe_pdo(0x181, keep));
  EXPECT_FALSE(net.master->subscribe_pdo(0x181, keep));
  EXPECT_FALSE(net.master->subscribe_pdo(0x080, keep));
  EXPECT_FALSE(net.master->subscribe_pdo(0x701, keep));
  net.port->receive(0x181, Bytes{0x37, 0x02});
  ASSERT_TRUE(net.master->subscribe_pdo(0x181, nullptr));
  net.port->receive(0x181, Bytes{0x37, 0x03});
  EXPECT_THAT(received, ElementsAre(Bytes{0x37, 0x02}));

  EXPECT_TRUE(
      net.run(net.master->send_pdo(0x201, {0x0F, 0x00}, {.transaction_class = TransactionClass::motion})));
  EXPECT_THAT(net.port->log, ElementsAre("201#0F00"));
  const auto gate = std::make_shared<AxisGate>();
  const can::SendOptions late{.guard = {.gate = gate, .epoch = gate->epoch()}};
  gate->raise();
  EXPECT_EQ(net.run(net.master->send_pdo(0x201, {0x1F, 0x00}, late)).error().reason, Reason::superseded);
  EXPECT_FALSE(net.run(net.master->send_pdo(0, {}, {})));
  EXPECT_FALSE(net.run(net.master->send_pdo(0x201, Bytes(9), {})));
}

TEST(Sync, KeepsItsTimesAndStopsWithTheLink) {
  Network net;
  std::vector<TimePoint> seen;
  const auto begin = net.world.now();
  ASSERT_TRUE(net.master->sync().start({.period = 10ms}, [&](TimePoint at) { seen.push_back(at); }));
  net.world.run_for(1005ms);
  ASSERT_EQ(seen.size(), 100U);
  EXPECT_EQ(seen.back() - begin, 1s + net.port->frame_time);
  EXPECT_EQ(net.port->log.front(), "080#");
  EXPECT_EQ(net.master->sync().counters().missed, 0U);
  net.port->set_link(can::InterfaceState::stalled);
  net.port->set_link(can::InterfaceState::up);
  net.world.run_for(1s);
  EXPECT_EQ(seen.size(), 100U);
  EXPECT_FALSE(net.master->sync().running());
}

TEST(Sync, LeavesOutWhatItMissedAndKeepsThePhase) {
  Network net;
  const auto begin = net.world.now();
  ASSERT_TRUE(net.master->sync().start({.period = 10ms, .counter_overflow = 3}));
  net.world.clock().advance_to(begin + 37ms);  // the core was busy: due at 10, 20 and 30
  net.world.run_for(13ms);
  EXPECT_THAT(net.port->log, ElementsAre("080#01", "080#02"));
  EXPECT_EQ(net.master->sync().counters().missed, 2U);
  EXPECT_EQ(net.master->sync().counters().latest, 27ms);
  net.world.run_for(10ms);
  EXPECT_EQ(net.port->times.back(), begin + 50ms + net.port->frame_time);
  net.port->next_status = can::SendStatus::expired;
  net.world.run_for(10ms);
  EXPECT_EQ(net.master->sync().counters().missed, 3U);
  EXPECT_FALSE(net.master->sync().start({.period = 100us}));
  EXPECT_FALSE(net.master->sync().start({.counter_overflow = 1}));
}

TEST(Identity, IsReadToleratingWhatIsMissingAndCompared) {
  Network net;
  net.servers[1].objects = {{{0x1000, 0}, {0x00040192, 4}},
                            {{0x1018, 0}, {3, 1}},
                            {{0x1018, 1}, {0x100, 4}},
                            {{0x1018, 2}, {3, 4}}};
  const auto identity = net.run(read_identity(net.master->node(1)));
  ASSERT_TRUE(identity);
  EXPECT_EQ(identity->profile(), 402);
  EXPECT_EQ(identity->vendor, 0x100U);
  EXPECT_EQ(identity->product, 3U);
  EXPECT_FALSE(identity->revision);
  EXPECT_TRUE(check_identity(*identity, {.profile = 402, .vendor = 0x100, .product = 3}));
  EXPECT_TRUE(check_identity(*identity, {}));
  const auto wrong = check_identity(*identity, {.product = 4});
  EXPECT_EQ(wrong.error().reason, Reason::wrong_model);
  EXPECT_THAT(wrong.error().message, HasSubstr("product 0x00000004"));
  EXPECT_THAT(wrong.error().message, HasSubstr("product 0x00000003"));
  EXPECT_FALSE(check_identity(*identity, {.revision = 1}));
  EXPECT_EQ(net.run(read_identity(net.master->node(2))).error().reason, Reason::no_reply);
}

}  // namespace
}  // namespace axisd::canopen
