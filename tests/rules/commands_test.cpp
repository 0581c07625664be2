// Commands end exactly once, repeats attach, requests expire; the manual's own examples; the wire's silences.
#include <gtest/gtest.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

TEST(Commands, ARepeatAttachesOtherContentConflicts) {
  Rig rig;
  rig.ready();
  const MoveRelativeRequest move{.distance = 10};
  const CommandOptions options{.client = "c", .request_id = "r"};
  const auto first = rig.submit(move, options);
  EXPECT_EQ(rig.submit(move, options), first);
  rig.run(5s);
  EXPECT_EQ(rig.submit(move, options), first) << "also when it has ended";
  EXPECT_EQ(rig.try_submit(MoveRelativeRequest{.distance = 11}, options).error().reason,
            Reason::request_id_conflict);
  EXPECT_EQ(rig.load_mm(), 10);
  EXPECT_NE(rig.submit(move, {.client = "d", .request_id = "r"}), first);
  rig.run(5s);
  EXPECT_EQ(rig.load_mm(), 20);
  // Stops are never deduplicated.
  rig.line->forget_wire();
  const auto stop = rig.submit(StopRequest{}, {.client = "c", .request_id = "s"});
  rig.run(1s);
  EXPECT_NE(rig.submit(StopRequest{}, {.client = "c", .request_id = "s"}), stop);
  rig.run(1s);
  EXPECT_EQ(rig.writes_of(0x0028), 2);
}

TEST(Commands, ExpiredRequestsAreRefusedOrNotSent) {
  Rig rig;
  rig.ready();
  const auto late = rig.world.now() - 1ms;
  EXPECT_EQ(rig.try_submit(MoveRelativeRequest{.distance = 1}, {.not_after = late}).error().reason,
            Reason::expired);
  // It expires while a halt still decelerates: accepted, never sent.
  rig.submit(MoveAbsoluteRequest{.position = 390, .with = {.deceleration_time = 2000ms}});
  rig.run(1s);
  rig.line->forget_wire();
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 1}, {.not_after = rig.world.now() + 500ms});
  rig.run(10s);
  EXPECT_EQ(move->value().state, CommandState::aborted) << describe(move->value());
  EXPECT_EQ(move->value().cause->reason, Reason::expired);
  EXPECT_EQ(rig.triggers(), 0);
  EXPECT_EQ(rig.try_submit(MoveRelativeRequest{.distance = 1}, {.lease_token = 7}).error().reason,
            Reason::lease_lost);
}

TEST(Commands, EndExactlyOnce) {
  Rig rig;
  rig.ready();
  const auto token = std::make_shared<int>(0);
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 100});
  std::vector<CommandState> states;
  move->observe(token, [&](const Command& now) { states.push_back(now.state); });
  rig.run(300ms);
  rig.submit(StopRequest{});
  rig.submit(DisableRequest{});
  move->done();
  move->unknown({});
  rig.run(5s);
  EXPECT_EQ(states, (std::vector<CommandState>{CommandState::active, CommandState::aborted}));
}

/// 6.2.5: one revolution (1000 pulses here) at 500 r/min, start 10 r/min, ramps 100 ms.
TEST(Examples, PositionMove) {
  Rig rig({.adjust = [](AxisSettings& axis) { axis.limits.start_speed_rpm = 10; }});
  rig.ready();
  std::vector<std::uint16_t> block;
  std::uint16_t trigger = 0;
  rig.line->set_on_bind([&](const WireEntry& entry) {
    if (!entry.is_write() || entry.address() != 0x0027) return;
    trigger = entry.value();
    for (std::uint16_t i = 0; i < 6; ++i) block.push_back(rig.drive->peek(0x0020 + i));
  });
  const double rpm500 = 500.0 / 60 * 10;
  const auto move = rig.complete(MoveRelativeRequest{
      .distance = 10, .with = {.velocity = rpm500, .acceleration_time = 100ms, .deceleration_time = 100ms}});
  EXPECT_EQ(move.state, CommandState::done) << describe(move);
  EXPECT_EQ(block, (std::vector<std::uint16_t>{0x000A, 0x0064, 0x0064, 0x01F4, 0x0000, 0x03E8}));
  EXPECT_EQ(trigger, 5);
}

TEST(Examples, SpeedMode) {
  Rig rig({.adjust = [](AxisSettings& axis) { axis.limits.start_speed_rpm = 10; }, .limits = false});
  rig.ready();
  std::vector<std::uint16_t> block;
  std::uint16_t trigger = 0;
  rig.line->set_on_bind([&](const WireEntry& entry) {
    if (!entry.is_write() || entry.address() != 0x0027) return;
    trigger = entry.value();
    for (std::uint16_t i = 0; i < 4; ++i) block.push_back(rig.drive->peek(0x0020 + i));
  });
  rig.submit(MoveVelocityRequest{.velocity = 500.0 / 60 * 10});
  rig.run(1s);
  EXPECT_EQ(block, (std::vector<std::uint16_t>{0x000A, 0x0064, 0x0064, 0x01F4}));
  EXPECT_EQ(trigger, 2);
}

TEST(Wire, SilenceBeforeEachRequest) {
  Rig rig;
  rig.ready();
  rig.fault({.kind = simulation::FaultKind::drop_reply, .skip = 3, .count = 2});
  rig.fault({.kind = simulation::FaultKind::delay_reply, .skip = 8, .count = 3, .delay = 50ms});
  rig.submit(MoveAbsoluteRequest{.position = 100});
  rig.run(500ms);
  rig.submit(StopRequest{});
  rig.run(2s);
  const auto& wire = rig.line->wire();
  ASSERT_GT(wire.size(), 50U);
  for (std::size_t i = 1; i < wire.size(); ++i) EXPECT_GE(wire[i].begin - wire[i - 1].end, 1750us);
}

}  // namespace
}  // namespace axisd::test
