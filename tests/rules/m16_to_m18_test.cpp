// Motion without end, the last resort, directions: M16 to M18.
#include <gtest/gtest.h>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "daemon/core/quiesce.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

TEST(M16, JogAndVelocityEndAtTheSoftLimitEvenIfTheDaemonDies) {
  both_directions({}, [](const RigOptions& options) {
    for (const double velocity : {80.0, -80.0}) {
      for (const bool jog : {false, true}) {
        Rig rig(options);
        rig.ready();
        rig.complete(MoveAbsoluteRequest{.position = 100});
        rig.submit(jog ? Action(JogRequest{.velocity = velocity, .hold = 2s})
                       : Action(MoveVelocityRequest{.velocity = velocity}));
        EXPECT_EQ(rig.state()->state, AxisState::continuous_motion);
        rig.run(100ms);
        rig.line->network().set_connected(false);
        rig.run(10s);
        rig.drive->advance(rig.world.now());
        EXPECT_NEAR(rig.load_mm(), velocity > 0 ? 400 : 0, 1e-9);
        EXPECT_FALSE(rig.drive->shaft_moving());
      }
    }
  });
}

TEST(M16, AtTheSoftLimitOnlyTheOtherWay) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    EXPECT_EQ(rig.try_submit(JogRequest{.velocity = -10}).error().reason, Reason::soft_limit);
    EXPECT_EQ(rig.try_submit(MoveVelocityRequest{.velocity = -10}).error().reason, Reason::soft_limit);
    EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = -1}).error().reason, Reason::soft_limit);
    EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 400.1}).error().reason, Reason::soft_limit);
    EXPECT_EQ(rig.complete(JogRequest{.velocity = 10}).state, CommandState::aborted);
    EXPECT_GT(rig.load_mm(), 0);
    rig.run(1s);
    // Beyond a limit already: towards the range is allowed.
    rig.complete(SetPositionRequest{.position = 450});
    EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 460}).error().reason, Reason::soft_limit);
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 449}).state, CommandState::done);
  });
}

TEST(M16, UntrustedAxesJogAtMostJogTravel) {
  both_directions({}, [](const RigOptions& options) {
    for (const double velocity : {30.0, -30.0}) {
      Rig rig(options);
      rig.enable();
      EXPECT_EQ(rig.try_submit(MoveVelocityRequest{.velocity = velocity}).error().reason,
                Reason::not_trusted);
      EXPECT_EQ(rig.try_submit(MoveRelativeRequest{.distance = 10.1}).error().reason, Reason::not_trusted);
      EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 1}).error().reason, Reason::not_trusted);
      const auto jog = rig.complete(JogRequest{.velocity = velocity, .hold = 2s});
      EXPECT_EQ(jog.state, CommandState::done) << describe(jog);
      EXPECT_NEAR(rig.load_mm(), velocity > 0 ? 10 : -10, 1e-9);
    }
  });
}

TEST(M16, AJogRunsWhileRenewedAndHaltsAtExpiry) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto jog = rig.submit(JogRequest{.velocity = 50});
    for (int i = 0; i < 20; ++i) {
      rig.run(150ms);
      EXPECT_EQ(rig.submit(JogRequest{.velocity = 50}), jog);
      EXPECT_FALSE(jog->has_ended());
    }
    const auto last = rig.world.now();
    ASSERT_TRUE(rig.run_until([&] { return jog->has_ended(); }, 2s));
    EXPECT_EQ(jog->value().state, CommandState::aborted);
    EXPECT_EQ(jog->value().cause->reason, Reason::expired);
    EXPECT_NEAR(std::chrono::duration<double>(rig.world.now() - last).count(), 0.3, 0.03);
    rig.run(1s);
    EXPECT_FALSE(rig.drive->shaft_moving());
    EXPECT_EQ(rig.drive->starts(), 1);
    EXPECT_EQ(rig.state()->state, AxisState::standstill);
    EXPECT_EQ(rig.state()->trust, PositionTrust::set);
    EXPECT_NEAR(rig.state()->position, rig.load_mm(), 1e-9);
  });
}

TEST(M16, AHeldVelocityIsRenewedByRepeatingIt) {
  for (const bool limits : {false, true}) {
    Rig rig({.limits = limits});
    rig.ready();
    const MoveVelocityRequest held{.velocity = 50, .hold = 300ms};
    const auto command = rig.submit(held);
    for (int i = 0; i < 10; ++i) {
      rig.run(200ms);
      EXPECT_EQ(rig.submit(held), command);
    }
    EXPECT_EQ(rig.drive->starts(), 1);
    rig.run(2s);
    EXPECT_EQ(command->value().state, CommandState::aborted);
    EXPECT_EQ(command->value().cause->reason, Reason::expired);
    EXPECT_FALSE(rig.drive->shaft_moving());
  }
}

TEST(M16, ARepeatOfARenewalStartsNothing) {
  Rig rig;
  rig.ready();
  const JogRequest jog{.velocity = 50};
  const auto first = rig.submit(jog, {.client = "c", .request_id = "1"});
  rig.run(200ms);
  EXPECT_EQ(rig.submit(jog, {.client = "c", .request_id = "2"}), first);
  rig.run(3s);
  EXPECT_TRUE(first->has_ended());
  EXPECT_EQ(rig.submit(jog, {.client = "c", .request_id = "2"}), first);
  EXPECT_EQ(rig.submit(jog, {.client = "c", .request_id = "1"}), first);
  rig.run(1s);
  EXPECT_EQ(rig.drive->starts(), 1);
}

TEST(M16, WhatIsNotHeldAnyMoreDoesNotStart) {
  Rig rig;
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 390, .with = {.deceleration_time = 2000ms}});
  rig.run(1s);
  const auto jog = rig.submit(JogRequest{.velocity = -20, .hold = 200ms});
  rig.run(6s);
  EXPECT_TRUE(jog->has_ended());
  EXPECT_EQ(rig.drive->starts(), 1);
}

TEST(M16, EndlessOnlyWithoutPositionLimits) {
  for_each_switch({.limits = false}, [](const RigOptions& options) {
    for (const double velocity : {40.0, -40.0}) {
      Rig rig(options);
      rig.ready();
      rig.line->forget_wire();
      const auto command = rig.submit(MoveVelocityRequest{.velocity = velocity});
      rig.run(800ms);
      EXPECT_EQ(rig.state()->state, AxisState::continuous_motion);
      EXPECT_EQ(rig.state()->velocity > 0, velocity > 0);
      EXPECT_EQ(rig.load_mm() > 0, velocity > 0);
      EXPECT_FALSE(command->has_ended());
      EXPECT_EQ(rig.complete(StopRequest{.kind = StopKind::halt}).state, CommandState::done);
      EXPECT_EQ(command->value().state, CommandState::aborted);
      EXPECT_NEAR(rig.state()->position, rig.load_mm(), 1e-9);
    }
  });
}

/// `writes`: how many frames it sent that write.
core::QuiesceReport quiesce(Rig& rig, Duration limit, int* writes = nullptr) {
  rig.stop_daemon();
  std::optional<std::vector<core::QuiesceReport>> reports;
  auto make_line = [&rig, writes](const modbus_rtu::LineSettings& settings) {
    EXPECT_EQ(settings.echo_witness, rig.configuration.axes.front().axis.node);
    auto made = std::make_unique<VirtualLine>(rig.world, settings);
    rig.line = made.get();
    made->set_on_bind([writes](const WireEntry& entry) {
      if (writes != nullptr && entry.is_write()) ++*writes;
    });
    made->network().advance(rig.world.now());
    made->network().add(std::make_unique<BorrowedNode>(*rig.drive));
    return std::unique_ptr<modbus_rtu::Line>(std::move(made));
  };
  auto all = [&]() -> Task<> {
    core::QuiesceParts parts{
        .executor = rig.world.executor(), .clock = &rig.world.clock(), .make_line = make_line};
    reports = co_await core::quiesce(std::move(parts), rig.configuration, limit);
  };
  spawn(rig.world.executor(), all(), "quiesce");
  EXPECT_TRUE(rig.run_until([&] { return reports.has_value(); }, limit + 2s));
  rig.line = nullptr;
  rig.idle(10ms);
  return reports ? reports->at(0) : core::QuiesceReport{};
}

TEST(M17, QuiesceStopsWhatMoves) {
  both_directions({.limits = false}, [](const RigOptions& options) {
    for (const Action& motion : {Action(MoveVelocityRequest{.velocity = 50}),
                                 Action(MoveAbsoluteRequest{.position = 900}), Action(HomeRequest{})}) {
      Rig rig(options);
      rig.ready();
      rig.submit(motion);
      rig.run(500ms);
      const auto report = quiesce(rig, 3s);
      EXPECT_TRUE(report.confirmed) << report.detail;
      EXPECT_FALSE(rig.drive->shaft_moving());
    }
  });
}

/// What was started right before the daemon ended may begin yet: it is waited for, with the line free for
/// others.
TEST(M17, QuiesceStopsOnceWhatRests) {
  Rig rig;
  rig.ready();
  int writes = 0;
  const auto begin = rig.world.now();
  const auto report = quiesce(rig, 3s, &writes);
  EXPECT_TRUE(report.confirmed) << report.detail;
  EXPECT_EQ(writes, 1);
  EXPECT_GE(rig.world.now() - begin, 500ms);
}

TEST(M17, QuiesceReportsWhatItCouldNotStop) {
  Rig silent;
  silent.ready();
  silent.drive->set_power(false);
  const auto no_reply = quiesce(silent, 2s);
  EXPECT_FALSE(no_reply.confirmed);
  EXPECT_FALSE(no_reply.detail.empty());

  Rig goes_on({.switches = {{"stop_ignored_in_homing", true}}});
  goes_on.enable();
  goes_on.submit(HomeRequest{});
  goes_on.run(300ms);
  const auto moving = quiesce(goes_on, 1s);
  EXPECT_FALSE(moving.confirmed);
  EXPECT_EQ(moving.detail, "still moving");
}

TEST(M18, ALimitSwitchBlocksItsOwnAxisDirectionOnly) {
  for_each_switch({}, [](const RigOptions& options) {
    for (const bool positive : {false, true}) {
      Rig rig(options);
      rig.ready();
      rig.complete(MoveAbsoluteRequest{.position = 50});
      rig.set_input(positive ? "X1" : "X2", true);
      rig.run(500ms);
      const double into = positive ? 5 : -5;
      EXPECT_EQ(rig.try_submit(MoveRelativeRequest{.distance = into}).error().reason, Reason::limit_switch);
      EXPECT_EQ(rig.try_submit(JogRequest{.velocity = into}).error().reason, Reason::limit_switch);
      // The drive blocks the same direction: it was given mirrored functions.
      const auto starts = rig.drive->starts();
      rig.write_behind(0x0023, static_cast<std::uint16_t>(positive != options.invert ? 100 : -100));
      rig.write_behind(0x0027, 2);
      EXPECT_EQ(rig.drive->starts(), starts);
      EXPECT_FALSE(rig.drive->shaft_moving());
      rig.run(3s);  // taken for a restart: somebody else wrote the block
      rig.enable();
      const auto away = rig.complete(MoveRelativeRequest{.distance = -into});
      EXPECT_EQ(away.state, CommandState::done) << describe(away);
      EXPECT_NEAR(rig.load_mm(), 50 - into, 1e-9);
    }
  });
}

TEST(M18, PositiveIsPositive) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    rig.submit(MoveAbsoluteRequest{.position = 100});
    rig.run(500ms);
    EXPECT_GT(rig.state()->velocity, 0);
    EXPECT_GT(rig.load_mm(), 0);
    rig.run(10s);
    rig.submit(JogRequest{.velocity = -30});
    rig.run(250ms);
    EXPECT_LT(rig.state()->velocity, 0);
    EXPECT_FALSE(rig.state()->positive_direction);
    rig.run(2s);
    EXPECT_LT(rig.load_mm(), 100);
  });
}

}  // namespace
}  // namespace axisd::test
