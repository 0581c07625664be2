// Exchanges with serial settings or a turnaround of their own, and addresses that are used twice.
#include <gtest/gtest.h>

#include <algorithm>

#include "bus_rig.hpp"
#include "tests/support/register_node.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using axisd::test::RegisterNode;
using simulation::FaultKind;
using test::BusRig;

constexpr SerialSettings slow{.baud = 9600, .format = {.parity = Parity::even}};

Request read_of(std::uint8_t node, std::uint16_t address = 0, std::uint16_t count = 2) {
  return {.node = node, .address = address, .count = count};
}

/// A node that listens at 9600 8E1, on a line of 115200 8N1.
RegisterNode& add_slow_node(BusRig& rig) {
  return dynamic_cast<RegisterNode&>(rig.line->network().add(
      std::make_unique<RegisterNode>(7, std::map<std::uint16_t, std::uint16_t>{{0, 0x1234}, {1, 0x0200}},
                                     simulation::Serial{.baud = slow.baud, .format = slow.format})));
}

TEST(RtuBusOverrides, OtherSettingsReachAnotherNodeAndTheLineIsAsBeforeAfterwards) {
  BusRig rig;
  add_slow_node(rig);
  rig.transact("unheard", read_of(7));
  rig.transact("heard", read_of(7), {.transaction_class = TransactionClass::scan, .serial = slow});
  rig.read("after", 0x0003, 10);
  rig.world.run_for(1s);
  EXPECT_EQ(rig.results.at("unheard").error().reason, Reason::no_reply);
  ASSERT_TRUE(rig.results.at("heard")) << to_string(rig.results.at("heard").error());
  EXPECT_EQ(rig.results.at("heard")->registers.at(0), 0x1234);
  EXPECT_TRUE(rig.results.at("after"));
}

TEST(RtuBusOverrides, SilenceBeforeAndAfterIsThatOfTheSlowerSide) {
  BusRig rig;
  add_slow_node(rig);
  for (int i = 0; i < 3; ++i) {
    rig.read("own" + std::to_string(i), static_cast<std::uint16_t>(0x0003 + i), 1);
    rig.transact("other" + std::to_string(i), read_of(7, 0, static_cast<std::uint16_t>(1 + i)),
                 {.serial = slow});
  }
  rig.world.run_for(1s);
  const auto& wire = rig.line->wire();
  ASSERT_GE(wire.size(), 6U);
  int changes = 0;
  for (std::size_t i = 1; i < wire.size(); ++i) {
    const auto pause = wire[i].begin - wire[i - 1].end;
    EXPECT_GE(pause, std::max(silence(wire[i].serial), silence(wire[i - 1].serial))) << i;
    if (wire[i].serial != wire[i - 1].serial) ++changes;
  }
  EXPECT_EQ(changes, 5);
  for (const auto& entry : wire)
    EXPECT_EQ(entry.serial, entry.node() == 7 ? slow : rig.bus->settings().serial());
}

TEST(RtuBusOverrides, TheReplyTimeoutFollowsTheRate) {
  BusRig rig;
  auto& node = add_slow_node(rig);
  for (std::uint16_t i = 0; i < 100; ++i) node.registers[i] = i;
  rig.transact("long", read_of(7, 0, 100), {.serial = slow});  // 205 bytes take 235 ms at 9600 8E1
  rig.world.run_for(1s);
  ASSERT_TRUE(rig.results.at("long")) << to_string(rig.results.at("long").error());
  EXPECT_EQ(rig.results.at("long")->registers.at(99), 99);
}

TEST(RtuBusOverrides, ATurnaroundOfItsOwnWaitsLonger) {
  BusRig rig;
  rig.line->network().faults().add({.kind = FaultKind::delay_reply, .node = 1, .count = 2, .delay = 300ms});
  rig.read("usual", 0x0003, 10);
  rig.world.run_for(1s);
  rig.transact("patient", read_of(1, 0x0020, 4), {.turnaround_max = 500ms});
  rig.world.run_for(1s);
  EXPECT_EQ(rig.results.at("usual").error().reason, Reason::no_reply);
  EXPECT_TRUE(rig.results.at("patient"));
}

TEST(RtuBusOverrides, ANodeMayHaveATurnaroundOfItsOwn) {
  const auto wait_for = [](std::optional<Duration> own) {
    BusRig rig;
    if (own) rig.bus->set_turnaround_max(9, *own);
    rig.transact("read", read_of(9));  // nobody answers there
    rig.world.run_for(1s);
    EXPECT_EQ(rig.line->wire().size(), 1U);
    return rig.line->wire()[0].end - rig.line->wire()[0].begin;
  };
  const auto usual = wait_for(std::nullopt);
  EXPECT_EQ(wait_for(50ms) - usual, 30ms);
  EXPECT_EQ(usual - wait_for(5ms), 15ms);
}

TEST(RtuBusOverrides, AStopWaitsForASlowNodeAsLongAsThatNeeds) {
  BusRig rig;
  rig.bus->set_turnaround_max(9, 60ms);
  rig.transact("slow", read_of(9));
  rig.world.run_for(10ms);
  const auto begin = rig.line->wire().at(0).begin;
  rig.transact("stop",
               {.node = 1, .function = Function::write_single_register, .address = 0x0028, .values = {0}},
               {.transaction_class = TransactionClass::stop});
  rig.world.run_for(100ms);
  ASSERT_EQ(rig.line->wire().size(), 2U);
  EXPECT_GE(rig.line->wire()[1].begin - begin, 60ms);
  EXPECT_LE(rig.line->wire()[1].begin - begin, 63ms);
}

TEST(RtuBusOverrides, AStopDoesNotWaitForAPatientExchange) {
  BusRig rig;
  rig.transact("patient", read_of(9), {.turnaround_max = 3s});  // nobody answers there
  rig.world.run_for(100ms);
  const auto asked = rig.world.now();
  rig.transact("stop",
               {.node = 1, .function = Function::write_single_register, .address = 0x0028, .values = {0}},
               {.transaction_class = TransactionClass::stop});
  rig.world.run_for(100ms);
  ASSERT_EQ(rig.line->wire().size(), 2U);
  EXPECT_LE(rig.line->wire()[1].begin - asked, 25ms);
  EXPECT_TRUE(rig.results.at("stop"));
}

TEST(RtuBusOverrides, IdenticalReadsMergeOnlyWithTheSameSettings) {
  BusRig rig;
  add_slow_node(rig);
  rig.read("busy", 0x0003, 10);
  rig.transact("plain", read_of(7));
  rig.transact("own", read_of(7), {.serial = rig.bus->settings().serial()});  // nothing else than the line's
  rig.transact("slow", read_of(7), {.serial = slow});
  rig.transact("slow too", read_of(7), {.serial = slow});
  rig.transact("patient", read_of(7), {.turnaround_max = 40ms});
  rig.world.run_for(1s);
  const auto asked = [&](const SerialSettings& serial) {
    return std::ranges::count_if(rig.line->wire(), [&](const axisd::test::WireEntry& entry) {
      return entry.node() == 7 && entry.serial == serial && entry.request.at(5) == 2;
    });
  };
  EXPECT_EQ(asked(slow), 2) << "whether one may still go out is asked for each";
  EXPECT_TRUE(rig.results.at("slow"));
  EXPECT_TRUE(rig.results.at("slow too"));
  EXPECT_EQ(asked(rig.bus->settings().serial()), 2) << "the second one waits longer";
  EXPECT_FALSE(rig.results.at("plain"));
  EXPECT_FALSE(rig.results.at("own"));
  EXPECT_FALSE(rig.results.at("patient"));
  EXPECT_EQ(rig.results.size(), 6U);
}

TEST(RtuBusOverrides, StopsAndMotionNeverLeaveTheLinesSettings) {
  BusRig rig;
  for (const auto urgent : {TransactionClass::stop, TransactionClass::motion})
    rig.transact(std::string(to_string(urgent)), read_of(1), {.transaction_class = urgent, .serial = slow});
  rig.world.run_for(100ms);
  for (const auto& [name, result] : rig.results) EXPECT_EQ(result.error().reason, Reason::internal) << name;
  EXPECT_TRUE(rig.line->wire().empty());
}

/// However far the exchange in other settings is, the stop is next.
TEST(RtuBusOverrides, AStopWaitsAtMostForTheRestOfTheExchangeAndTheSwitch) {
  for (int offset = 0; offset < 60; ++offset) {
    BusRig rig;
    add_slow_node(rig);
    for (std::uint8_t node = 10; node < 20; ++node)
      rig.transact("probe" + std::to_string(node), read_of(node),
                   {.transaction_class = TransactionClass::scan, .serial = slow});
    rig.world.run_for(std::chrono::microseconds(offset * 1100));
    Request stop{.node = 2, .function = Function::write_single_register, .address = 0x0028, .values = {0}};
    const auto asked = rig.world.now();
    rig.transact("stop", stop, {.transaction_class = TransactionClass::stop});
    rig.world.run_for(2s);
    ASSERT_TRUE(rig.results.at("stop")) << offset;
    const auto& wire = rig.line->wire();
    const auto sent = std::ranges::find(wire, 0x0028, &axisd::test::WireEntry::address);
    ASSERT_NE(sent, wire.end());
    EXPECT_EQ(sent->serial, rig.bus->settings().serial());
    const auto bound = wire_time(slow, 8) + 20ms + silence(slow);  // request, turnaround_max, silence
    EXPECT_LE(sent->begin - asked, bound) << offset;
  }
}

TEST(RtuBusOverrides, WhatThePortCannotDoIsSaidAndNotSent) {
  BusRig rig;
  rig.line->set_can_do([](const SerialSettings& serial) { return serial.baud != slow.baud; });
  rig.transact("odd", read_of(1), {.serial = slow});
  rig.read("after", 0x0003, 10);
  rig.world.run_for(100ms);
  const auto& error = rig.results.at("odd").error();
  EXPECT_EQ(error.reason, Reason::not_supported);
  EXPECT_EQ(error.outcome, Outcome::not_sent);
  EXPECT_NE(error.message.find("9600 baud 8E1"), std::string::npos) << error.message;
  EXPECT_TRUE(rig.results.at("after"));
  EXPECT_EQ(rig.line->wire().size(), 1U);
}

TEST(RtuBusGarbled, AnAddressThatIsGarbledAgainAndAgainIsReportedAsUsedTwice) {
  BusRig rig;
  // Two on address 9 with different contents: they drive the line at once.
  for (const std::uint16_t content : {0x00FF, 0xFF00})
    rig.line->network().add(std::make_unique<RegisterNode>(
        9, std::map<std::uint16_t, std::uint16_t>{{0, content}, {1, content}, {2, content}}));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(rig.bus->garbled(9), i);
    rig.read("try", 0, 2, 9);
    rig.world.run_for(200ms);
    const auto& error = rig.results.at("try").error();
    EXPECT_EQ(error.reason, Reason::no_reply);
    EXPECT_EQ(error.outcome, Outcome::unknown);
    EXPECT_EQ(error.where.bus, "a");
    EXPECT_EQ(error.where.node, 9);
    EXPECT_EQ(error.message.find("two nodes on one address") != std::string::npos, i == 2) << error.message;
  }
  EXPECT_EQ(rig.bus->garbled(1), 0);
}

TEST(RtuBusGarbled, ASoundReplyOrSilenceBetweenThemEndsTheRow) {
  for (const bool silence_between : {false, true}) {
    BusRig rig;
    const auto corrupt = [&](int times) {
      rig.line->network().faults().add({.kind = FaultKind::corrupt_reply, .node = 1, .count = times});
      for (int i = 0; i < times; ++i) {
        rig.read("garbled", 0x0003, 10);
        rig.world.run_for(100ms);
      }
      EXPECT_EQ(rig.bus->garbled(1), times);
    };
    corrupt(2);
    if (silence_between)
      rig.line->network().faults().add({.kind = FaultKind::drop_reply, .node = 1, .count = 1});
    rig.read("between", 0x0003, 10);
    rig.world.run_for(200ms);
    EXPECT_EQ(rig.bus->garbled(1), 0);
    corrupt(2);
    EXPECT_EQ(rig.results.at("garbled").error().message, "only damaged bytes came back");
  }
}

/// Nobody may wait for ever for a length that a node does not answer.
TEST(RtuBusResync, EndsWhenNoReplyCanComeAnyMore) {
  BusRig rig;
  auto& node = dynamic_cast<RegisterNode&>(rig.line->network().add(
      std::make_unique<RegisterNode>(9, std::map<std::uint16_t, std::uint16_t>{{5, 55}})));
  node.ignores_unknown = true;  // a read of two registers is never answered
  node.silent = true;
  rig.read("lost", 5, 1, 9);
  rig.world.run_for(100ms);
  node.silent = false;
  rig.read("soon", 5, 1, 9);
  rig.world.run_for(100ms);
  EXPECT_FALSE(rig.results.at("soon"));
  rig.world.run_for(5s);
  rig.read("later", 5, 1, 9);
  rig.world.run_for(100ms);
  ASSERT_TRUE(rig.results.at("later"));
  EXPECT_EQ(rig.results.at("later")->registers.at(0), 55);
}

TEST(RtuBusResync, StaysWithinTheAddresses) {
  BusRig rig;
  rig.line->network().add(
      std::make_unique<RegisterNode>(9, std::map<std::uint16_t, std::uint16_t>{{0xFFFE, 1}, {0xFFFF, 2}}));
  rig.line->network().faults().add({.kind = FaultKind::drop_reply, .node = 9, .count = 1});
  for (const char* name : {"lost", "found"}) {
    rig.read(name, 0xFFFF, 1, 9);
    rig.world.run_for(100ms);
  }
  EXPECT_FALSE(rig.results.at("lost"));
  EXPECT_EQ(rig.results.at("found")->registers.at(0), 2);
}

}  // namespace
}  // namespace axisd::modbus_rtu
