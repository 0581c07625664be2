// Starts in motion, ends of motions, speeds: M9 to M11.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

TEST(M09, AStartWhileMovingIsStopConfirmStart) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto first = rig.submit(MoveAbsoluteRequest{.position = 200});
    rig.run(700ms);
    rig.line->forget_wire();
    rig.line->set_on_bind([&](const WireEntry& entry) {
      if (!entry.is_write() || entry.address() != 0x0027) return;
      rig.drive->advance(entry.begin);
      EXPECT_FALSE(rig.drive->shaft_moving()) << "started in motion";
      EXPECT_GE(rig.first_write(0x0028), 0);
    });
    const auto second = rig.submit(MoveAbsoluteRequest{.position = 20});
    EXPECT_EQ(rig.state()->state, AxisState::discrete_motion);
    EXPECT_EQ(first->value().state, CommandState::aborted);
    EXPECT_EQ(first->value().cause->reason, Reason::superseded);
    rig.run_until([&] { return second->has_ended(); }, 20s);
    EXPECT_EQ(second->value().state, CommandState::done) << describe(second->value());
    EXPECT_EQ(rig.load_mm(), 20);
    EXPECT_EQ(rig.writes_of(0x0027), 1);
    EXPECT_EQ(rig.drive->starts(), 2);
  });
}

TEST(M09, ASlowMoveBackAfterALongBrakingIsNotTakenForTooLong) {
  Rig rig;
  rig.ready();
  rig.complete(MoveAbsoluteRequest{.position = 50});
  const MotionValues fast{.velocity = 100, .acceleration_time = 2000ms, .deceleration_time = 2000ms};
  rig.submit(MoveAbsoluteRequest{.position = 390, .with = fast});
  rig.run_until([&] { return rig.state()->position > 151; }, 10s);
  // 1 mm away at 1 mm/s when it is asked for; the braking carries the axis some 100 mm further.
  const auto back = rig.complete(MoveAbsoluteRequest{.position = 150, .with = {.velocity = 1}}, 300s);
  EXPECT_EQ(back.state, CommandState::done) << describe(back);
  EXPECT_EQ(rig.load_mm(), 150);
}

TEST(M09, ManyReplacementsOnlyTheLastRuns) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    std::vector<CommandPtr> all;
    for (int i = 0; i < 20; ++i) {
      all.push_back(rig.submit(MoveAbsoluteRequest{.position = 100.0 + i}));
      rig.run(7ms);
    }
    rig.run(10s);
    for (std::size_t i = 0; i + 1 < all.size(); ++i) EXPECT_EQ(all[i]->value().state, CommandState::aborted);
    EXPECT_EQ(all.back()->value().state, CommandState::done) << describe(all.back()->value());
    EXPECT_EQ(rig.load_mm(), 119);
    EXPECT_LE(rig.drive->starts(), 2);
  });
}

TEST(M10, ALimitSwitchEndsTheMove) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(500ms);
    rig.set_input("X1", true);
    rig.run(2s);
    EXPECT_EQ(move->value().state, CommandState::aborted) << describe(move->value());
    EXPECT_EQ(move->value().cause->reason, Reason::limit_switch);
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    EXPECT_FALSE(rig.drive->shaft_moving());
  });
}

TEST(M10, TheLimitSwitchBehindDoesNotEndTheMove) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    rig.set_input("X2", true);
    const auto moved = rig.complete(MoveAbsoluteRequest{.position = 30});
    EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
    EXPECT_EQ(rig.state()->trust, PositionTrust::set);
  });
}

TEST(M10, AStopTerminalEndsTheMove) {
  for (const bool quick : {false, true}) {
    for_each_switch(
        {.adjust =
             [quick](AxisSettings& axis) {
               axis.inputs.push_back({.terminal = "X3", .function = quick ? "quick_stop" : "stop"});
             }},
        [quick](const RigOptions& options) {
          for (const auto held : {15ms, 3000ms}) {
            Rig rig(options);
            rig.ready();
            const auto move = rig.submit(MoveAbsoluteRequest{.position = 300});
            rig.run(500ms);
            rig.set_input("X3", true);
            rig.run(held);
            rig.set_input("X3", false);
            rig.run(3s);
            EXPECT_TRUE(move->has_ended());
            EXPECT_TRUE(move->value().state == CommandState::aborted ||
                        move->value().state == CommandState::error);
            if (held > 1s) EXPECT_EQ(move->value().cause->reason, Reason::terminal);
            EXPECT_FALSE(rig.drive->shaft_moving());
            EXPECT_NE(rig.state()->state, AxisState::discrete_motion);
            // Without a ramp an open loop may have lost steps (M20).
            if (quick) EXPECT_EQ(rig.state()->trust, PositionTrust::unknown) << held.count();
          }
        });
  }
}

TEST(M10, MotorFreeEndsTheMove) {
  for_each_switch(
      {.adjust =
           [](AxisSettings& axis) { axis.inputs.push_back({.terminal = "X3", .function = "motor_free"}); }},
      [](const RigOptions& options) {
        for (const bool enable : {false, true}) {
          Rig rig(options);
          if (enable || !rig.state()->enabled) rig.enable();
          rig.complete(SetPositionRequest{});
          const auto move = rig.submit(MoveAbsoluteRequest{.position = 300});
          rig.run(500ms);
          rig.line->forget_wire();
          rig.set_input("X3", true);
          rig.run(1s);
          EXPECT_EQ(move->value().state, CommandState::aborted) << describe(move->value());
          EXPECT_EQ(move->value().cause->reason, Reason::terminal);
          EXPECT_EQ(rig.state()->state, AxisState::disabled);
          EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
          rig.set_input("X3", false);
          rig.run(1s);
          EXPECT_EQ(rig.triggers(), 0);
          EXPECT_FALSE(rig.drive->shaft_moving());
        }
      });
}

TEST(M10, DidNotStart) {
  // Acknowledged and ignored: a stop terminal that the configuration does not know.
  for_each_switch({}, [](const RigOptions& options) {
    if (options.switches.contains("stop_terminal_only_edge")) return;
    Rig rig(options);
    rig.ready();
    rig.write_behind(0x0047, 8);
    rig.set_input("X4", true);
    rig.run(300ms);
    rig.line->forget_wire();
    const auto move = rig.complete(MoveAbsoluteRequest{.position = 30});
    EXPECT_EQ(move.state, CommandState::error) << describe(move);
    EXPECT_EQ(move.cause->reason, Reason::did_not_start);
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    rig.run(1s);
    EXPECT_GE(rig.writes_of(0x0028), 1);
    EXPECT_EQ(rig.writes_of(0x0027), 1);
  });
}

TEST(M10, TookTooLong) {
  // Another master slows the drive down between block and trigger.
  Rig rig({.switches = {{"start_in_motion", true}}});
  rig.ready();
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 100});
  rig.run(200ms);
  rig.write_behind(0x0023, 10);
  rig.write_behind(0x0027, 5);
  rig.write_behind(0x0023, 600);  // or it would look like a restart
  rig.line->forget_wire();
  rig.run(15s);
  EXPECT_EQ(move->value().state, CommandState::error) << describe(move->value());
  EXPECT_EQ(move->value().cause->reason, Reason::took_too_long);
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  EXPECT_EQ(rig.try_submit(MoveRelativeRequest{.distance = 1}).error().reason, Reason::fault);
  EXPECT_GE(rig.writes_of(0x0028), 1);
  EXPECT_FALSE(rig.drive->shaft_moving());
}

TEST(M10, StoppedByAnotherMaster) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 100});
    rig.run(200ms);
    rig.write_behind(0x0028, 0);
    rig.run(2s);
    EXPECT_EQ(move->value().state, CommandState::error);
    EXPECT_EQ(move->value().cause->reason, Reason::not_reached) << describe(move->value());
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    EXPECT_EQ(rig.complete(ResetRequest{}).state, CommandState::done);
    // The base of the next relative move is where it is, not where it should have been.
    const auto here = rig.load_mm();
    if (rig.state()->trust == PositionTrust::unknown) rig.complete(SetPositionRequest{.position = 50});
    const auto next = rig.complete(MoveRelativeRequest{.distance = 5});
    EXPECT_EQ(next.state, CommandState::done) << describe(next);
    EXPECT_NEAR(rig.load_mm(), here + 5, 0.02);
  });
}

TEST(M10, AMoveToWhereItIsSendsNothing) {
  Rig rig;
  rig.ready();
  rig.line->forget_wire();
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 0}).state, CommandState::done);
  EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 0}).state, CommandState::done);
  EXPECT_EQ(rig.triggers(), 0);
}

TEST(M10, EveryRefusedStartEnds) {
  // Started in alarm or released: refused by exception, or acknowledged and ignored.
  for (const bool refused : {false, true}) {
    Rig rig({.switches = {{"start_refused_when_disabled", refused}}});
    rig.ready();
    rig.run_until(
        [&, before = rig.state()->sampled.after()] { return rig.state()->sampled.after() != before; }, 1s);
    rig.write_behind(0x0029, 0);
    const auto move = rig.complete(MoveAbsoluteRequest{.position = 30});
    EXPECT_TRUE(move.state == CommandState::error || move.state == CommandState::aborted) << describe(move);
    EXPECT_FALSE(move.cause->remedy.empty()) << describe(move);
    rig.run(2s);
    EXPECT_EQ(rig.state()->state, AxisState::disabled);
    EXPECT_EQ(rig.drive->starts(), 0);
  }
}

TEST(M11, SpeedLimitOfTheMicrostepSetting) {
  struct Case {
    std::int64_t pulses;
    int rpm;
  };
  for (const auto& [pulses, rpm] : {Case{200, 3000},
                                    {1000, 3000},
                                    {4000, 3000},
                                    {5000, 2400},
                                    {10000, 1200},
                                    {12800, 937},
                                    {40000, 300}}) {
    SCOPED_TRACE(pulses);
    const auto adjust = [pulses](AxisSettings& axis) {
      axis.scale = {.pulses_per_revolution = pulses, .invert = axis.scale.invert, .unit = "rev"};
      axis.limits.position_minimum.reset();
      axis.limits.position_maximum.reset();
      axis.limits.velocity = 1000;
      axis.homing.reset();
    };
    both_directions({.adjust = adjust}, [&](const RigOptions& options) {
      Rig rig(options);
      rig.ready();
      const auto most = rpm / 60.0;
      const auto beyond =
          rig.try_submit(MoveRelativeRequest{.distance = 10, .with = {.velocity = most * 1.01}});
      ASSERT_FALSE(beyond);
      EXPECT_EQ(beyond.error().reason, Reason::out_of_range);
      EXPECT_NEAR(beyond.error().permitted->maximum, most, 1e-9);
      EXPECT_EQ(rig.try_submit(MoveVelocityRequest{.velocity = -most * 1.01}).error().reason,
                Reason::out_of_range);
      rig.line->forget_wire();
      const auto at_most = rig.complete(MoveRelativeRequest{.distance = 1, .with = {.velocity = most}});
      EXPECT_EQ(at_most.state, CommandState::done) << describe(at_most);
      EXPECT_EQ(rig.drive->peek(0x0023), rpm);
      EXPECT_NEAR(*at_most.granted.velocity, most, 1e-9);
    });
  }
}

TEST(M11, SpeedIsPositiveNotZeroAndNotBelowTheStartSpeed) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    for (const double bad : {0.0, -0.0, 1e-9, 0.1})
      EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 10, .with = {.velocity = bad}}).error().reason,
                Reason::out_of_range);
    const auto nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(rig.try_submit(MoveAbsoluteRequest{.position = nan}));
    EXPECT_FALSE(rig.try_submit(MoveAbsoluteRequest{.position = 1, .with = {.velocity = nan}}));
    EXPECT_FALSE(rig.try_submit(MoveRelativeRequest{.distance = nan}));
    EXPECT_FALSE(rig.try_submit(JogRequest{.velocity = nan}));
    EXPECT_FALSE(rig.try_submit(MoveVelocityRequest{.velocity = nan}));
    EXPECT_FALSE(rig.try_submit(SetPositionRequest{.position = nan}));
    for (const double huge : {1e300, -1e300, 1e18})
      EXPECT_FALSE(rig.try_submit(MoveAbsoluteRequest{.position = huge}));
    rig.line->forget_wire();
    // 0.5 mm/s is 3 r/min, below the configured start speed of 5: that is lowered with it.
    const auto slow = rig.complete(MoveAbsoluteRequest{.position = 0.5, .with = {.velocity = 0.5}});
    EXPECT_EQ(slow.state, CommandState::done) << describe(slow);
    EXPECT_EQ(rig.drive->peek(0x0023), 3);
    EXPECT_LE(rig.drive->peek(0x0020), 3);
    EXPECT_GE(rig.drive->peek(0x0020), 2);
  });
}

TEST(M11, GrantedIsNeverFasterThanAsked) {
  Rig rig;
  rig.ready();
  for (int step = 0; step <= 45; ++step) {  // up to 98 mm/s
    const double velocity = 0.4 * std::pow(1.13, step);
    const auto moved = rig.complete(MoveRelativeRequest{.distance = 0.01, .with = {.velocity = velocity}});
    EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
    EXPECT_LE(*moved.granted.velocity, velocity * (1 + 1e-6));
    EXPECT_NEAR(*moved.granted.velocity, rig.drive->peek(0x0023) / 6.0, 1e-9);
  }
}

}  // namespace
}  // namespace axisd::test
