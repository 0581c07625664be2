// Reset of an alarm on CANopen: what CiA 402 says of it, and what it leaves alone (M1, M2, M5, M14).
#include <gtest/gtest.h>

#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t fault_reset = 0x80, halt = 0x100, state_bits = 0x0F;

/// Chapter 8 has alarm 2 recover by itself; by CiA 402 Fault is left by a reset only.
TEST(M05, AResetClearsAnAlarmOnceItsCauseIsGone) {
  for_each_reading({}, {{"fault_needs_reset"}, {"alarm_keeps_torque"}, {"bit7_is_warning"}},
                   [](const CanRigOptions& options) {
                     CanRig rig(options);
                     rig.ready();
                     rig.touch([](auto& node) { node.raise_alarm(2); });
                     rig.run(500ms);
                     ASSERT_EQ(rig.state()->state, AxisState::error_stop);
                     const auto early = rig.complete(ResetRequest{});
                     EXPECT_EQ(early.state, CommandState::error) << describe(early);
                     ASSERT_TRUE(early.cause);
                     EXPECT_EQ(early.cause->reason, Reason::alarm);
                     EXPECT_EQ(early.cause->where.native_code, 2U);
                     EXPECT_FALSE(early.cause->remedy.empty());
                     EXPECT_EQ(rig.state()->state, AxisState::error_stop);

                     rig.touch([](auto& node) { node.raise_alarm(0); });
                     rig.run(500ms);
                     EXPECT_EQ(rig.state()->state, AxisState::error_stop) << "latched";
                     rig.done(ResetRequest{});
                     EXPECT_EQ(rig.state()->state, AxisState::disabled);
                     EXPECT_EQ(rig.state()->alarm_code, 0);
                     rig.ready();
                     rig.done(MoveRelativeRequest{.distance = 1});
                   });
}

TEST(M05, WhatOnlyThePowerSupplyEndsIsRefusedAtOnce) {
  CanRig rig;
  rig.ready();
  rig.touch([](auto& node) { node.raise_alarm(5); });
  rig.run(500ms);
  const auto reset = rig.machine->submit("feeder", ResetRequest{}, {});
  ASSERT_FALSE(reset);
  EXPECT_EQ(reset.error().reason, Reason::alarm);
  EXPECT_NE(reset.error().remedy.find("switch the drive off and on"), std::string::npos);
}

/// The drive may have left Fault by itself, with the motor held: no word on the way may release it.
TEST(M02, AResetLeavesThePowerStageAsItIs) {
  CanRig rig;
  rig.ready();
  rig.touch([](auto& node) { node.raise_alarm(4); });
  rig.run(500ms);
  rig.frames.clear();
  rig.done(ResetRequest{});
  const auto words = rig.writes_of(0x604000);
  ASSERT_FALSE(words.empty());
  EXPECT_TRUE(std::ranges::any_of(words, [](auto word) { return (word & fault_reset) != 0; }));
  for (const auto word : words) {
    EXPECT_EQ(word & state_bits, 0x0FU);
    EXPECT_NE(word & halt, 0U);
  }
  EXPECT_EQ(words.back() & fault_reset, 0U) << "the next reset needs an edge";
}

TEST(M14, NothingOfAResetFollowsAStop) {
  for (const auto object : {0x60FF00U, 0x604000U}) {
    CanRig rig;
    rig.ready();
    rig.touch([](auto& node) { node.raise_alarm(4); });
    rig.run(500ms);
    rig.frames.clear();
    const auto reset = rig.submit(ResetRequest{});
    ASSERT_TRUE(rig.run_until([&] { return !rig.writes_of(object).empty(); }, 1s));
    const auto before = rig.writes_of(0x604000).size();
    rig.done(StopRequest{});
    EXPECT_TRUE(reset->has_ended());
    EXPECT_EQ(reset->value().state, CommandState::aborted) << describe(reset->value());
    rig.run(1s);
    const auto words = rig.writes_of(0x604000);
    ASSERT_GT(words.size(), before);
    for (auto word = words.begin() + static_cast<std::ptrdiff_t>(before); word != words.end(); ++word)
      EXPECT_EQ(*word, state_bits | halt) << "only the stop's";
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  }
}

}  // namespace
}  // namespace axisd::test
