// What is counted of SDO transfers, by class.
#include <gtest/gtest.h>

#include "network.hpp"

namespace axisd::canopen {
namespace {

using namespace test;

constexpr Object status{0x6041, 0}, device_type{0x1000, 0};

TEST(SdoClasses, TellHowLongTransfersWaitAndTake) {
  Network net;
  net.turnaround = 5ms;
  net.servers[1].objects[status] = {0x0237, 2};
  net.upload("first", 1, status, {.transaction_class = TransactionClass::idle_state});
  net.upload("second", 1, status, {.transaction_class = TransactionClass::motion});
  net.upload("late", 1, status, {.deadline = net.world.now() + 1ms});
  net.world.run_for(100us);
  EXPECT_EQ(net.counted(TransactionClass::motion).waiting, 1U);
  net.world.run_for(100ms);
  ASSERT_TRUE(net.results.at("second"));
  const auto first = net.counted(TransactionClass::idle_state);
  EXPECT_EQ(first.sent, 1U);
  EXPECT_EQ(first.queueing.longest(), net.port->frame_time);
  EXPECT_EQ(first.exchange.longest(), net.turnaround);
  const auto second = net.counted(TransactionClass::motion);
  EXPECT_EQ(second.waiting, 0U);
  EXPECT_EQ(second.most_waiting, 1U);
  EXPECT_EQ(second.queueing.longest(), 2 * net.port->frame_time + net.turnaround);
  EXPECT_EQ(second.exchange.longest(), net.turnaround);
  EXPECT_EQ(net.counted(TransactionClass::parameters).sent, 0U);
  EXPECT_EQ(net.counted(TransactionClass::parameters).drops.expired, 1U);
}

TEST(SdoClasses, CountEachAttemptAndNotWhatBringsANodeInStep) {
  Network net;
  net.servers[1].objects = {{status, {0x0237, 2}}, {device_type, {402, 4}}};
  net.servers[1].answers = false;
  net.upload("read", 1, status);
  net.world.run_for(50ms);
  net.servers[1].answers = true;
  net.world.run_for(200ms);
  ASSERT_TRUE(net.results.at("read"));
  const auto counted = net.counted(TransactionClass::parameters);
  EXPECT_EQ(counted.sent, 2U);
  EXPECT_EQ(counted.exchange.longest(), 100ms);
  net.upload("gone", 1, status);
  net.upload("queued", 1, status);
  net.world.run_for(10us);
  net.port->set_link(can::InterfaceState::down);
  net.world.run_for(10ms);
  EXPECT_EQ(net.counted(TransactionClass::parameters).drops.port_lost, 2U);
  EXPECT_EQ(net.counted(TransactionClass::parameters).sent, 2U);
}

}  // namespace
}  // namespace axisd::canopen
