// SYNC: what an earlier master armed, and nodes that may hold something.
#include <gtest/gtest.h>

#include "config/fields.hpp"
#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// Whatever sends PDOs and SDOs beside axisd.
void put(simulation::SimulatedCanNode& node, std::uint32_t id, std::vector<std::uint8_t> bytes) {
  node.on_frame(can::make_frame(id, bytes));
}

void write(simulation::SimulatedCanNode& node, std::uint16_t index, std::uint8_t sub, std::uint8_t size,
           std::uint32_t value) {
  put(node, 0x600U + CanRig::node_id,
      {static_cast<std::uint8_t>(0x23U | (4U - size) << 2U), static_cast<std::uint8_t>(index),
       static_cast<std::uint8_t>(index >> 8U), sub, static_cast<std::uint8_t>(value),
       static_cast<std::uint8_t>(value >> 8U), static_cast<std::uint8_t>(value >> 16U),
       static_cast<std::uint8_t>(value >> 24U)});
}

void expect_nothing_armed_starts(const CanRigOptions& options) {
  for (const std::uint16_t number : {0, 1}) {
    SCOPED_TRACE(number);
    CanRig rig(options);
    rig.ready();
    rig.stop_daemon();
    rig.touch([&](auto& node) {
      const auto parameters = static_cast<std::uint16_t>(0x1400 + number);
      const auto mapping = static_cast<std::uint16_t>(0x1600 + number);
      const auto id = 0x200U + 0x100U * number + CanRig::node_id;
      put(node, 0, {0x80, CanRig::node_id});
      write(node, parameters, 1, 4, 0x80000000U | id);
      write(node, mapping, 0, 1, 0);
      write(node, mapping, 1, 4, 0x60400010);
      write(node, mapping, 2, 4, 0x607A0020);
      write(node, mapping, 0, 1, 2);
      write(node, parameters, 2, 1, 1);
      write(node, parameters, 1, 4, id);
      write(node, 0x6060, 0, 1, 1);
      write(node, 0x6040, 0, 2, 0x0F);
      put(node, 0, {0x01, CanRig::node_id});
      put(node, id, {0x1F, 0, 0x10, 0x27, 0, 0});
    });
    const auto at = rig.shaft();
    rig.start_daemon();
    rig.run(1s);
    EXPECT_GT(rig.count_of(0x80), 10);
    EXPECT_EQ(rig.shaft(), at);
    rig.ready();
    rig.done(MoveAbsoluteRequest{.position = 3});
    EXPECT_EQ(rig.state()->link_note, "");
  }
}

TEST(M24, WhatAnEarlierMasterArmedNeverStarts) {
  for_each_reading({.sync_period = 10ms, .limits = false},
                   {{"rpdo_kept"}, {"rpdo_applied_by_type"}, {"rpdo_kept", "rpdo_applied_by_type"}},
                   &expect_nothing_armed_starts);
}

/// A set-point that was taken stands in the control word: where a stop comes between, it would be a new one.
TEST(M24, WhatTakesThePlaceOfAnArmedWordStartsNothing) {
  CanRig rig({.sync_period = 10ms, .limits = false});
  rig.ready();
  rig.stop_daemon();
  constexpr std::uint32_t id = 0x300U + CanRig::node_id;
  rig.touch([&](auto& node) {
    write(node, 0x6060, 0, 1, 1);
    write(node, 0x607A, 0, 4, node.peek(0x606400));
    for (const std::uint32_t word : {0x0FU, 0x1FU}) write(node, 0x6040, 0, 2, word);
  });
  rig.start_daemon();
  rig.run(1s);
  EXPECT_GT(rig.count_of(id), 0);
  for (const auto& [at, frame] : rig.frames)
    if (frame.id == id) EXPECT_EQ(frame.data[0] & 0x90U, 0U) << to_string(frame);
}

TEST(M24, ANodeThatIsHeardButDoesNotAnswerKeepsSyncFromStarting) {
  CanRig rig({.sync_period = 10ms, .limits = false, .connect = false});
  rig.reconnect();
  rig.stop_daemon();
  rig.network.set_fault([](const can::Frame& frame) {
    return can::Network::Fault{.drop = frame.id == 0x580U + CanRig::node_id};
  });
  rig.touch([](auto& node) { write(node, 0x1017, 0, 2, 250); });
  rig.start_daemon();
  rig.run(3s);
  EXPECT_EQ(rig.count_of(0x80), 0);
  rig.network.set_fault({});
  rig.reconnect();
  rig.run(1s);
  EXPECT_GT(rig.count_of(0x80), 10);
}

/// A reload exchanges the axis: SYNC waits until the new one has settled the node, and nothing starts.
TEST(M24, ANodeWhoseAxisIsExchangedIsSettledAnew) {
  CanRig rig({.sync_period = 10ms, .limits = false});
  rig.ready();
  rig.done(MoveAbsoluteRequest{.position = 3});
  const auto at = rig.shaft();
  auto wanted = rig.configuration;
  wanted.axes.at(0).axis.limits.velocity = 50;
  auto& bus = *rig.machine->networks().front();
  ASSERT_TRUE(bus.sync_running());
  bool through = false;
  rig.machine->reload({.client = "fitter",
                       .configuration = wanted,
                       .changes = config::differences(rig.configuration, wanted)},
                      [&](const std::vector<Error>& refusals) {
                        EXPECT_TRUE(refusals.empty()) << to_string(refusals.front());
                        through = true;
                        EXPECT_FALSE(bus.sync_running());
                      });
  ASSERT_TRUE(rig.run_until([&] { return through; }, 5s));
  rig.reconnect();
  ASSERT_TRUE(rig.run_until([&] { return bus.sync_running(); }, 5s));
  rig.run(1s);
  EXPECT_EQ(rig.shaft(), at);
  EXPECT_TRUE(rig.state()->enabled) << "M1: the power stage is left alone";
  EXPECT_EQ(rig.state()->link_note, "");
  rig.done(SetPositionRequest{.position = 0});
  rig.done(MoveAbsoluteRequest{.position = 3});
  EXPECT_NE(rig.shaft(), at);
}

/// An energised drive shows it once it is released; whatever the release changed was published before that.
TEST(M24, WhetherItStartsBySyncIsPublishedAsSoonAsItIsKnown) {
  CanRig rig({.sync_period = 10ms, .before_start = [](auto& node) {
                write(node, 0x6060, 0, 1, 1);
                for (const std::uint32_t word : {0x00U, 0x06U, 0x07U, 0x0FU}) write(node, 0x6040, 0, 2, word);
              }});
  rig.run(3s);
  EXPECT_NE(rig.state()->start_note.find("released"), std::string::npos) << rig.state()->start_note;
  rig.done(DisableRequest{});
  EXPECT_NE(rig.state()->start_note, "");
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->start_note.empty(); }, 5s)) << rig.state()->start_note;
  CanRig without({.sync_period = 0ms});
  EXPECT_NE(without.state()->start_note.find("sync_period is 0"), std::string::npos);
}

}  // namespace
}  // namespace axisd::test
