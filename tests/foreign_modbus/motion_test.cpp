// The life of an axis on a Modbus drive of another maker, by the ordinary axis and core.
#include <gtest/gtest.h>

#include "tests/foreign_modbus/registers.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::Fault;
using simulation::FaultKind;
namespace reg = acme_s1::reg;

/// 8192 counts per revolution, which are 81.92 mm: 100 counts per mm, as with the other models of the rig.
RigOptions servo(RigOptions options = {}) {
  options.model = "acme-s1";
  options.adjust = [more = std::move(options.adjust)](AxisSettings& axis) {
    axis.scale.pulses_per_revolution = 8192;
    axis.scale.travel_numerator = 8192;
    axis.scale.travel_denominator = 100;
    axis.inputs = {{.terminal = "I2", .function = "home"}};
    if (more) more(axis);
  };
  return options;
}

int commands(const Rig& rig) { return rig.writes_of(reg::command); }

/// Just after a reading: the next one is a while away.
void await_reading(Rig& rig) {
  const auto before = rig.state()->sampled.after();
  rig.run_until([&] { return rig.state()->sampled.after() != before; }, 1s);
}

TEST(ForeignMotion, ConfiguredEnabledAndMovedOnce) {
  both_directions(servo(), [](const RigOptions& options) {
    Rig rig(options);
    EXPECT_EQ(rig.drive->peek(reg::second_input), acme_s1::function::home);
    EXPECT_EQ(rig.state()->identity->model_code, acme_s1::model_code);
    EXPECT_EQ(rig.state()->identity->version, "2.07");
    EXPECT_EQ(rig.state()->state, AxisState::disabled);
    rig.ready();
    EXPECT_EQ(rig.state()->state, AxisState::standstill);
    rig.line->forget_wire();
    const auto moved = rig.complete(MoveAbsoluteRequest{.position = 25});
    EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
    EXPECT_NEAR(rig.load_mm(), 25, 1e-9);
    EXPECT_EQ(commands(rig), 1);
    EXPECT_EQ(rig.drive->starts(), 1);
    rig.run(2s);
    EXPECT_EQ(rig.drive->starts(), 1);
    EXPECT_NEAR(rig.state()->position, 25, 0.05);
  });
}

/// Each start: the tag is read, the block written, the command sent, within reboot_guard.
TEST(ForeignMotion, AStartIsTagBlockCommand) {
  Rig rig(servo());
  rig.ready();
  int seen = 0;
  rig.line->set_on_bind([&](const WireEntry& entry) {
    if (!entry.is_write() || entry.address() != reg::command) return;
    ++seen;
    const auto& wire = rig.line->wire();  // ends with this entry
    ASSERT_GE(wire.size(), 3U);
    const auto& block = wire[wire.size() - 2];
    const auto& tag = wire[wire.size() - 3];
    EXPECT_EQ(block.address(), reg::target_low);
    EXPECT_EQ(block.block().size(), acme_s1::profile_count);
    EXPECT_EQ(tag.address(), reg::tag);
    EXPECT_LE(entry.begin - tag.begin, 100ms);
  });
  for (const double target : {10.0, 3.0, 7.5, 0.0})
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = target}).state, CommandState::done);
  EXPECT_EQ(seen, 4);
}

TEST(ForeignMotion, UnitsReachTheWireInTheDrivesOwnScale) {
  both_directions(servo(), [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    rig.line->forget_wire();
    const MotionValues with{.velocity = 40.96, .acceleration_time = 120ms, .deceleration_time = 250ms};
    const auto moved = rig.complete(MoveAbsoluteRequest{.position = 300, .with = with});
    EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
    EXPECT_NEAR(*moved.granted.velocity, 40.96, 1e-9);
    const auto target = static_cast<std::uint32_t>(options.invert ? -30'000 : 30'000);
    EXPECT_EQ(rig.line->wire().at(static_cast<std::size_t>(rig.first_write(reg::target_low))).block(),
              (std::vector<std::uint16_t>{static_cast<std::uint16_t>(target),
                                          static_cast<std::uint16_t>(target >> 16U), 300, 120, 250}));
    EXPECT_NEAR(rig.load_mm(), 300, 1e-9);
  });
}

TEST(ForeignMotion, HomedToItsSwitch) {
  both_directions(servo(), [](const RigOptions& options) {
    Rig rig(options);
    rig.enable();
    const auto homed = rig.complete(HomeRequest{});
    EXPECT_EQ(homed.state, CommandState::done) << describe(homed);
    EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
    EXPECT_NEAR(rig.state()->position, 0, 0.05);
    EXPECT_NEAR(rig.load_mm(), -50, 0.05);
    EXPECT_EQ(rig.drive->starts(), 1);
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 20}).state, CommandState::done);
    EXPECT_NEAR(rig.load_mm(), -30, 0.05);
  });
}

TEST(ForeignMotion, StopsAndMovesOn) {
  for (const auto kind : {StopKind::halt, StopKind::stop, StopKind::quick_stop}) {
    Rig rig(servo());
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 200});
    rig.run(800ms);
    ASSERT_TRUE(rig.drive->shaft_moving());
    const auto stopped = rig.complete(StopRequest{.kind = kind});
    EXPECT_EQ(stopped.state, CommandState::done) << describe(stopped);
    EXPECT_EQ(move->value().state, CommandState::aborted);
    EXPECT_FALSE(rig.drive->shaft_moving());
    EXPECT_EQ(rig.drive->starts(), 1);
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 0}).state, CommandState::done);
    EXPECT_NEAR(rig.load_mm(), 0, 1e-9);
  }
}

TEST(ForeignMotion, TurnsAtAVelocityUntilItIsHalted) {
  Rig rig(servo({.limits = false}));
  rig.ready();
  const auto turning = rig.submit(MoveVelocityRequest{.velocity = -40.96});
  rig.run(2s);
  EXPECT_EQ(rig.state()->state, AxisState::continuous_motion);
  EXPECT_NEAR(rig.state()->velocity, -40.96, 0.5);
  EXPECT_EQ(rig.complete(StopRequest{.kind = StopKind::halt}).state, CommandState::done);
  EXPECT_TRUE(turning->has_ended());
  EXPECT_FALSE(rig.drive->shaft_moving());
}

/// M6, M7: switched off and on at every so many milliseconds of a move, and of its start.
TEST(ForeignMotion, RestartedInMidMoveItGoesNoFurther) {
  for (const auto boot : {101ms, 300ms}) {
    for (int offset = 0; offset < 700; offset += 7) {
      SCOPED_TRACE(offset);
      Rig rig(servo({.adjust_drive = [boot](auto& node) { node.boot_time = boot; }}));
      rig.ready();
      const auto move = rig.submit(MoveAbsoluteRequest{.position = 30});
      rig.run(std::chrono::milliseconds(offset));
      rig.drive->advance(rig.world.now());
      const auto load = rig.load_mm();
      const bool was_done = move->value().state == CommandState::done;
      rig.cycle_power();
      rig.run(4s);
      EXPECT_TRUE(move->has_ended());
      EXPECT_NEAR(rig.load_mm(), load, 1e-9) << "moved after the power cycle";
      EXPECT_LE(rig.drive->starts(), 1);
      if (!was_done) EXPECT_NE(move->value().state, CommandState::done);
      EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
      EXPECT_FALSE(rig.state()->enabled_by_us);
    }
  }
}

/// M7: what nobody could have seen is found by the canary of the start.
TEST(ForeignMotion, RestartedBetweenTwoReadingsItIsNotStarted) {
  Rig rig(servo({.adjust_drive = [](auto& node) { node.boot_time = 101ms; }}));
  rig.ready();
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 20}).state, CommandState::done);
  await_reading(rig);
  rig.cycle_power();
  rig.run(110ms);
  rig.line->forget_wire();
  const auto move = rig.complete(MoveRelativeRequest{.distance = 10});
  EXPECT_EQ(move.cause->reason, Reason::rebooted) << describe(move);
  EXPECT_EQ(commands(rig), 0);
  EXPECT_EQ(rig.drive->starts(), 1);
  EXPECT_EQ(rig.state()->reboots, 1);
}

/// M8: the reply to the command is lost; it is found out whether the drive moves, and nothing is sent twice.
TEST(ForeignMotion, ALostReplyToAStartIsResolvedByReadingBack) {
  for (const auto kind : {FaultKind::drop_reply, FaultKind::drop_request}) {
    SCOPED_TRACE(static_cast<int>(kind));
    Rig rig(servo());
    rig.ready();
    rig.line->forget_wire();
    rig.fault({.kind = kind, .node = 1, .function = 0x06, .register_address = reg::command});
    const auto moved = rig.complete(MoveAbsoluteRequest{.position = 25});
    rig.run(2s);
    EXPECT_EQ(commands(rig), 1);
    if (kind == FaultKind::drop_reply) {
      EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
      EXPECT_EQ(rig.drive->starts(), 1);
      EXPECT_NEAR(rig.load_mm(), 25, 1e-9);
    } else {
      EXPECT_NE(moved.state, CommandState::done) << describe(moved);
      EXPECT_EQ(rig.drive->starts(), 0);
      EXPECT_EQ(rig.load_mm(), 0);
    }
  }
}

/// M20: a restart of the daemon proves by the mark of two words that the drive kept its memory.
TEST(ForeignMotion, ThePositionIsRestoredAfterARestartOfTheDaemon) {
  for (const bool killed : {false, true}) {
    Rig rig(servo({.persistence = true, .journal = true}));
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 25}).state, CommandState::done);
    rig.run(3s);
    EXPECT_EQ(rig.store.current().axes.at("feeder").offset->canary.size(), acme_s1::tag_count);
    killed ? rig.kill_daemon() : rig.stop_daemon();
    rig.idle(1s);
    rig.start_daemon();
    EXPECT_EQ(rig.state()->trust, PositionTrust::restored);
    EXPECT_NEAR(rig.state()->position, 25, 0.05);
    rig.stop_daemon();
    rig.cycle_power();
    rig.idle(1s);
    rig.start_daemon();
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  }
}

TEST(ForeignMotion, AlarmsEndTheMotionAndAreReset) {
  Rig rig(servo());
  rig.ready();
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 200});
  rig.run(800ms);
  rig.drive->advance(rig.world.now());
  rig.drive->raise_alarm(0x8611);
  rig.run(1s);
  EXPECT_TRUE(move->has_ended());
  EXPECT_EQ(move->value().cause->reason, Reason::alarm) << describe(move->value());
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  EXPECT_TRUE(move->value().cause->message.contains("following_error")) << move->value().cause->message;
  rig.drive->raise_alarm(0);
  EXPECT_EQ(rig.complete(ResetRequest{}).state, CommandState::done);
  EXPECT_EQ(rig.state()->fault, std::nullopt);
}

/// M30: what is measured wavers.
TEST(ForeignMotion, ArrivesWithAnEncoderThatWavers) {
  Rig rig(servo({.adjust_drive = [](auto& node) { node.encoder = {.noise = 2, .following = 5ms}; }}));
  rig.ready();
  for (const double target : {10.0, 200.0, 199.0, 0.5}) {
    const auto moved = rig.complete(MoveAbsoluteRequest{.position = target});
    EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
    EXPECT_NEAR(rig.load_mm(), target, 0.05);
  }
}

}  // namespace
}  // namespace axisd::test
