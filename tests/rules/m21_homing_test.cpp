// Homing: M21, and M18 for its four methods.
#include <gtest/gtest.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// Home switch from -52 to -50 mm, limits at -60 and 460 mm, in axis direction (see Rig).
RigOptions homing_by(HomingMethod method, double offset = 0) {
  return {.adjust = [method, offset](AxisSettings& axis) {
    axis.homing->method = method;
    axis.homing->velocity = 50;
    axis.homing->search_velocity = 5;
    axis.homing->position = 3;
    axis.homing->offset = offset;
    axis.homing->timeout = 60s;
  }};
}

TEST(M21, FourMethodsInAxisDirection) {
  for (const auto method : {HomingMethod::home_positive, HomingMethod::home_negative,
                            HomingMethod::positive_limit, HomingMethod::negative_limit}) {
    SCOPED_TRACE(static_cast<int>(method));
    for_each_switch(homing_by(method), [method](const RigOptions& options) {
      Rig rig(options);
      rig.enable();
      const auto home = rig.submit(HomeRequest{});
      EXPECT_EQ(rig.state()->state, AxisState::homing);
      rig.run_until([&] { return rig.drive->shaft_moving(); }, 1s);
      rig.run(300ms);
      rig.drive->advance(rig.world.now());
      const bool positive = method == HomingMethod::home_positive || method == HomingMethod::positive_limit;
      EXPECT_EQ(rig.load_mm() > 0, positive) << "searches in the wrong direction";
      rig.run_until([&] { return home->has_ended(); }, 100s);
      EXPECT_EQ(home->value().state, CommandState::done) << describe(home->value());
      EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
      EXPECT_NEAR(rig.state()->position, 3, 0.02);
      const double where = method == HomingMethod::positive_limit   ? 460
                           : method == HomingMethod::negative_limit ? -60
                                                                    : -51;
      EXPECT_NEAR(rig.load_mm(), where, 1.1);
      EXPECT_FALSE(rig.drive->shaft_moving());
      EXPECT_EQ(rig.writes_of(0x0030), 1);
      // Positions and truth agree from here on.
      const auto at_home = rig.load_mm() - rig.state()->position;
      EXPECT_EQ(
          rig.complete(MoveAbsoluteRequest{.position = method == HomingMethod::positive_limit ? 1.0 : 20.0},
                       120s)
              .state,
          CommandState::done);
      EXPECT_NEAR(rig.load_mm() - rig.state()->position, at_home, 1e-9);
    });
  }
}

TEST(M21, HomingAgainWithTheBitLeftOver) {
  for (const double offset : {0.0, 6.0, -6.0}) {
    for_each_switch(homing_by(HomingMethod::home_negative, offset), [](const RigOptions& options) {
      Rig rig(options);
      rig.enable();
      ASSERT_EQ(rig.complete(HomeRequest{}).state, CommandState::done);
      rig.complete(MoveAbsoluteRequest{.position = 43.21});
      const auto again = rig.complete(HomeRequest{});
      EXPECT_EQ(again.state, CommandState::done) << describe(again);
      EXPECT_NEAR(rig.state()->position, 3, 0.02);
      // From home itself: the switch may be active, then it is left first.
      const auto third = rig.complete(HomeRequest{});
      EXPECT_EQ(third.state, CommandState::done) << describe(third);
    });
  }
}

TEST(M21, StoppedOnTheWayIsNotHomed) {
  auto options = homing_by(HomingMethod::home_negative, 6);
  const auto adjust = options.adjust;
  for (const bool quick : {false, true}) {
    options.adjust = [adjust, quick](AxisSettings& axis) {
      adjust(axis);
      axis.inputs.push_back({.terminal = "X3", .function = quick ? "quick_stop" : "stop"});
    };
    for_each_switch(options, [](const RigOptions& each) {
      for (const auto when : {100ms, 400ms, 900ms}) {
        Rig rig(each);
        rig.enable();
        ASSERT_EQ(rig.complete(HomeRequest{}).state, CommandState::done);  // the bit is left over
        ASSERT_EQ(rig.complete(MoveAbsoluteRequest{.position = 60}).state, CommandState::done);
        const auto home = rig.submit(HomeRequest{});
        rig.run(when);
        rig.set_input("X3", true);
        rig.run(15ms);
        rig.set_input("X3", false);
        rig.run(3s);
        ASSERT_TRUE(home->has_ended());
        EXPECT_EQ(home->value().state, CommandState::error) << describe(home->value());
        EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
        EXPECT_FALSE(rig.drive->shaft_moving());
      }
    });
  }
}

TEST(M21, OnTheSwitchWithoutBackoffIsRefused) {
  both_directions({.adjust = [](AxisSettings& axis) { axis.homing->backoff.reset(); }},
                  [](const RigOptions& options) {
                    Rig rig(options);
                    rig.enable();
                    rig.set_input("X0", true);
                    rig.run(500ms);
                    EXPECT_EQ(rig.try_submit(HomeRequest{}).error().reason, Reason::limit_switch);
                    EXPECT_EQ(rig.triggers(), 0);
                  });
}

TEST(M21, BacksOffABoundedWay) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.enable();
    rig.set_input("X0", true);  // stuck
    rig.run(500ms);
    const auto home = rig.complete(HomeRequest{});
    EXPECT_EQ(home.state, CommandState::error);
    EXPECT_EQ(home.cause->reason, Reason::limit_switch) << describe(home);
    EXPECT_NEAR(rig.load_mm(), 5, 1e-9) << "against the search direction, by backoff";
    EXPECT_EQ(rig.writes_of(0x0030), 0);
  });
}

/// What was executed of it is not denied by what was not.
TEST(M21, AHomingThatBackedOffAndCouldNotStartSaysSo) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.enable();
    rig.set_input("X0", true);
    rig.run(500ms);
    const auto home = rig.submit(HomeRequest{});
    ASSERT_TRUE(rig.run_until([&] { return rig.drive->shaft_moving(); }, 5s));
    rig.set_input("X0", false);
    rig.fault({.kind = simulation::FaultKind::corrupt_reply, .register_address = 0x0031, .count = -1});
    ASSERT_TRUE(rig.run_until([&] { return home->has_ended(); }, 30s));
    EXPECT_EQ(home->value().state, CommandState::error);
    EXPECT_EQ(home->value().cause->outcome, Outcome::unknown);
    EXPECT_NE(home->value().cause->message.find("executed in part"), std::string::npos)
        << describe(home->value());
    EXPECT_EQ(rig.writes_of(0x0030), 0);
  });
}

TEST(M21, ASwitchThatIsNeverFoundEndsInTime) {
  for (const bool travel : {false, true}) {
    for_each_switch({.adjust =
                         [travel](AxisSettings& axis) {
                           axis.inputs = {{.terminal = "X0", .function = "home"}};
                           axis.homing->timeout = 8s;
                           if (travel) axis.homing->max_travel = 60;
                         },
                     .adjust_drive = [](auto& node) { node.mechanics = {}; }},
                    [travel](const RigOptions& options) {
                      if (options.switches.contains("stop_ignored_in_homing")) return;
                      Rig rig(options);
                      rig.enable();
                      const auto home = rig.complete(HomeRequest{});
                      EXPECT_EQ(home.state, CommandState::error);
                      EXPECT_EQ(home.cause->reason, travel ? Reason::not_reached : Reason::took_too_long);
                      EXPECT_NE(home.cause->message.find("; it is being stopped"), std::string::npos)
                          << "it turns as this is told: " << home.cause->message;
                      rig.run(3s);
                      EXPECT_FALSE(rig.drive->shaft_moving());
                      EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
                      if (travel) EXPECT_NEAR(rig.load_mm(), -60, 4);
                    });
  }
}

TEST(M21, MaxTravelDoesNotCountTheZeroingOfTheCounter) {
  auto options = homing_by(HomingMethod::home_negative, 6);
  const auto adjust = options.adjust;
  options.adjust = [adjust](AxisSettings& axis) {
    adjust(axis);
    axis.homing->max_travel = 50;
  };
  for_each_switch(options, [](const RigOptions& each) {
    // The switch is 10 mm away, but 380 mm from the counter's 0.
    auto there = each;
    there.adjust_drive = [invert = each.invert](simulation::SimulatedNodeSettings& node) {
      node.mechanics.home_switch_from = invert ? -38000 : 37800;
      node.mechanics.home_switch_to = invert ? -37800 : 38000;
    };
    Rig rig(there);
    rig.ready();
    ASSERT_EQ(rig.complete(MoveAbsoluteRequest{.position = 390}).state, CommandState::done);
    const auto home = rig.complete(HomeRequest{});
    EXPECT_EQ(home.state, CommandState::done) << describe(home);
    EXPECT_NEAR(rig.state()->position, 3, 0.02);
  });
}

}  // namespace
}  // namespace axisd::test
