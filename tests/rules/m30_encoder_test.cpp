// Drives with an encoder as it really is (M10, M30): noise at rest, following error, late settling. Nothing
// compares a measured position for equality. And the mode register, which proves nothing at rest (M10, M21).
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

constexpr double pulses_per_mm = 1000;
constexpr std::string_view closed_loops[] = {"ssd2608pr", "ess42-r"};

/// The rig with 10000 pulses and 4000 counts per revolution: one count is 2.5 um, the window of 10 is 25 um.
RigOptions measured(std::string_view model, int noise) {
  RigOptions options{.model = std::string(model)};
  options.adjust = [](AxisSettings& axis) {
    axis.scale.pulses_per_revolution = 10'000;
    axis.homing->method = HomingMethod::negative_limit;
    axis.homing->position = -60;
    axis.homing->max_travel = 600;
    if (axis.model != "ykd2405pr") axis.model_settings["released_position"] = std::string("counted");
  };
  options.adjust_drive = [noise](simulation::SimulatedNodeSettings& node) {
    for (auto* position : {&node.mechanics.home_switch_from, &node.mechanics.home_switch_to,
                           &node.mechanics.positive_limit_from, &node.mechanics.negative_limit_from})
      if (*position) **position *= 10;
    node.encoder = {.noise = noise, .following = 8ms, .quantised = true, .compliance = 10};
  };
  return options;
}

/// Both models, noise of 0, 1 and 2 counts, plain and inverted.
void on_each(const std::function<void(const RigOptions&)>& test) {
  for (const auto model : closed_loops)
    for (const int noise : {0, 1, 2}) {
      SCOPED_TRACE(std::string(model) + " noise " + std::to_string(noise));
      both_directions(measured(model, noise), test);
    }
}

double load_of(Rig& rig, const RigOptions& options) {
  rig.drive->advance(rig.world.now());
  return static_cast<double>(rig.drive->shaft_pulses()) / pulses_per_mm * (options.invert ? -1 : 1);
}

void expect_done(const Command& command) {
  EXPECT_EQ(command.state, CommandState::done) << describe(command);
}

TEST(M30, EverythingWorksOnAMeasuredPosition) {
  on_each([](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto zero = load_of(rig, options);
    expect_done(rig.complete(MoveAbsoluteRequest{.position = 100}));
    EXPECT_NEAR(load_of(rig, options) - zero, 100, 0.0061);
    EXPECT_NEAR(rig.state()->position, 100, 0.03);
    expect_done(rig.complete(MoveRelativeRequest{.distance = -30}));
    EXPECT_NEAR(load_of(rig, options) - zero, 70, 0.0061);
    const auto jog = rig.submit(JogRequest{.velocity = 20, .hold = 200ms});
    EXPECT_TRUE(rig.run_until([&] { return jog->has_ended(); }, 5s));
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->state == AxisState::standstill; }, 5s));
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(500ms);
    expect_done(rig.complete(StopRequest{}));
    expect_done(rig.complete(DisableRequest{}));
    expect_done(rig.complete(EnableRequest{}));
    EXPECT_EQ(rig.state()->trust, PositionTrust::set);
    expect_done(rig.complete(MoveAbsoluteRequest{.position = 10}));
    EXPECT_NEAR(load_of(rig, options) - zero, 10, 0.0061);
  });
}

TEST(M30, DoneIsWithinTheDrivesWindowAndNotBeforeItHasSettled) {
  for (const auto model : closed_loops) {
    auto options = measured(model, 1);
    const auto fast = options.adjust_drive;
    options.adjust_drive = [fast](simulation::SimulatedNodeSettings& node) {
      fast(node);
      node.encoder.following = 40ms;
    };
    Rig rig(options);
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 50});
    ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 10s));
    expect_done(move->value());
    EXPECT_NEAR(rig.state()->position, 50, 0.026) << "10 counts of 2.5 um";
  }
}

TEST(M30, WhatDoesNotArriveIsNotDone) {
  on_each([](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 50});
    rig.run(300ms);
    rig.write_behind(0x0028, 0);  // another master stops it
    ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 10s));
    EXPECT_EQ(move->value().state, CommandState::error) << describe(move->value());
    ASSERT_TRUE(move->value().cause);
    EXPECT_EQ(move->value().cause->reason, Reason::not_reached);
    EXPECT_EQ(move->value().cause->remedy, "check terminals, and other masters on the bus");
  });
}

/// A hand, or the load, keeps the shaft from the target: neither a terminal nor another master does.
TEST(M30, AShaftThatIsHeldOffItsTargetIsCalledThat) {
  constexpr int counts = 40;  // of 2.5 um
  for (const auto model : closed_loops) {
    auto options = measured(model, 0);
    options.adjust_drive = [usual = options.adjust_drive](simulation::SimulatedNodeSettings& node) {
      usual(node);
      node.encoder.compliance = counts;
    };
    both_directions(options, [](const RigOptions& each) {
      Rig rig(each);
      rig.ready();
      const auto move = rig.submit(MoveAbsoluteRequest{.position = 50});
      rig.run(300ms);
      ASSERT_TRUE(rig.drive->lean_on_shaft(counts));
      ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 10s));
      EXPECT_EQ(move->value().state, CommandState::error) << describe(move->value());
      ASSERT_TRUE(move->value().cause);
      EXPECT_EQ(move->value().cause->reason, Reason::not_reached);
      EXPECT_NE(move->value().cause->message.find(", 0.1 mm from its target"), std::string::npos)
          << move->value().cause->message;
      for (const auto* word : {"holds or loads", "current", "settle", "position_tolerance"})
        EXPECT_NE(move->value().cause->remedy.find(word), std::string::npos) << word;
    });
  }
}

TEST(M30, MovesSmallerThanTheWindowAreMade) {
  on_each([](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto zero = load_of(rig, options);
    for (int i = 1; i <= 12; ++i) {
      expect_done(rig.complete(MoveRelativeRequest{.distance = 0.002}));
      EXPECT_NEAR(load_of(rig, options) - zero, i * 0.002, 0.0061) << i;
    }
    for (int i = 11; i >= 0; --i) expect_done(rig.complete(MoveRelativeRequest{.distance = -0.002}));
    EXPECT_NEAR(load_of(rig, options) - zero, 0, 0.0061);
  });
}

/// A shaft may rest a window short of where it was sent: as near to its start as one that never began (M8).
TEST(M30, AShortMoveIsNotTakenForOneThatNeverBegan) {
  on_each([](const RigOptions& options) {
    for (int pulses = 20; pulses <= 60; ++pulses) {
      for (const bool answered : {true, false}) {
        for (const bool positive : {true, false}) {
          SCOPED_TRACE(fmt::format("{} pulses, {}", positive ? pulses : -pulses, answered));
          Rig rig(options);
          rig.ready();
          expect_done(rig.complete(MoveAbsoluteRequest{.position = 1}));
          const auto starts = rig.drive->starts();
          // Nor do the readings that would show it moving.
          if (!answered) {
            rig.fault({.kind = FaultKind::drop_reply, .register_address = 0x0027});
            rig.line->set_on_bind([&](const WireEntry& entry) {
              if (entry.is_write() && entry.address() == 0x0027)
                rig.fault({.kind = FaultKind::drop_reply, .function = 0x03, .count = 2});
            });
          }
          const auto moved =
              rig.complete(MoveRelativeRequest{.distance = (positive ? pulses : -pulses) / pulses_per_mm});
          ASSERT_EQ(rig.drive->starts(), starts + 1);
          if (answered) expect_done(moved);
          if (moved.cause) EXPECT_EQ(moved.cause->outcome, Outcome::unknown) << describe(moved);
        }
      }
    }
  });
}

/// One that rests where it was, and further from its target than a window, never began.
TEST(M30, AMoveThatNeverBeganIsToldWhereThePositionTells) {
  on_each([](const RigOptions& options) {
    for (const int pulses : {40, 80}) {
      SCOPED_TRACE(pulses);
      Rig rig(options);
      rig.ready();
      rig.fault({.kind = FaultKind::drop_request, .register_address = 0x0027});
      const auto moved = rig.complete(MoveRelativeRequest{.distance = pulses / pulses_per_mm});
      ASSERT_EQ(rig.drive->starts(), 0);
      ASSERT_TRUE(moved.cause) << describe(moved);
      EXPECT_EQ(moved.cause->outcome, Outcome::not_executed);
    }
  });
}

TEST(M30, HomeEndsDoneAndAgain) {
  on_each([](const RigOptions& options) {
    Rig rig(options);
    rig.enable();
    double home = 0;
    for (int i = 0; i < 3; ++i) {
      const auto command = rig.complete(HomeRequest{});
      expect_done(command);
      EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
      if (i == 0) home = load_of(rig, options);
      expect_done(rig.complete(MoveAbsoluteRequest{.position = 20}));
      EXPECT_NEAR(load_of(rig, options) - home, 80, 0.0011) << "the origin is the drive's, not one reading";
    }
  });
}

/// Home is told of while the shaft still follows: what is measured then is not the origin.
TEST(M30, HomeIsTheDrivesOriginHoweverLateTheShaftSettles) {
  for (const bool stays : {false, true})
    for (const auto model : closed_loops) {
      auto options = measured(model, 1);
      options.switches["homed_stays_during_homing"] = stays;
      options.adjust = [adjust = options.adjust](AxisSettings& axis) {
        adjust(axis);
        axis.homing->search_velocity = 20;
      };
      options.adjust_drive = [adjust = options.adjust_drive](simulation::SimulatedNodeSettings& node) {
        adjust(node);
        node.encoder.following = 40ms;
      };
      both_directions(options, [](const RigOptions& one) {
        Rig rig(one);
        rig.enable();
        for (int i = 0; i < 2; ++i) {
          expect_done(rig.complete(HomeRequest{}));
          const auto home = load_of(rig, one);
          expect_done(rig.complete(MoveAbsoluteRequest{.position = 20}));
          EXPECT_NEAR(load_of(rig, one) - home, 80, 0.0011);
        }
      });
    }
}

TEST(M30, AtTheSoftwareLimitIsWithinWhatAReadingWavers) {
  on_each([](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    expect_done(rig.complete(MoveAbsoluteRequest{.position = 380}));
    for (const double way : {1.0, -1.0}) {
      const auto run = rig.submit(MoveVelocityRequest{.velocity = 80 * way});
      ASSERT_TRUE(rig.run_until([&] { return run->has_ended(); }, 30s));
      EXPECT_EQ(run->value().cause->reason, Reason::soft_limit) << describe(run->value());
      for (int i = 0; i < 20; ++i) {
        const auto again = rig.try_submit(MoveVelocityRequest{.velocity = 10 * way});
        ASSERT_FALSE(again) << i;
        EXPECT_EQ(again.error().reason, Reason::soft_limit);
        rig.run(7ms);
      }
    }
  });
}

TEST(M30, ARestartOfTheDaemonFindsItWhereItWas) {
  on_each([](RigOptions options) {
    options.persistence = options.journal = true;
    Rig rig(options);
    rig.ready();
    expect_done(rig.complete(MoveAbsoluteRequest{.position = 40}));
    const auto at = load_of(rig, options);
    for (int i = 0; i < 3; ++i) {
      rig.stop_daemon();
      rig.idle(77ms);
      rig.start_daemon();
      EXPECT_EQ(rig.state()->trust, PositionTrust::restored);
      EXPECT_NEAR(rig.state()->position, 40, 0.03);
    }
    expect_done(rig.complete(MoveAbsoluteRequest{.position = 50}));
    EXPECT_NEAR(load_of(rig, options) - at, 10, 0.0061);
  });
}

TEST(M30, OnlyAShaftThatTurnsFurtherThanItWaversHasMovedWhenItWasEnabled) {
  for (const auto model : closed_loops)
    for (const int counts : {5, 30}) {
      auto options = measured(model, 2);
      options.adjust_drive = [adjust = options.adjust_drive](simulation::SimulatedNodeSettings& node) {
        adjust(node);
        node.encoder.compliance = 40;
      };
      Rig rig(options);
      expect_done(rig.complete(DisableRequest{}));
      const auto enable = rig.submit(EnableRequest{});
      rig.run_until([&] { return rig.drive->lean_on_shaft(counts); }, 1s);  // as soon as it is energised
      ASSERT_TRUE(rig.run_until([&] { return enable->has_ended(); }, 5s));
      EXPECT_EQ(enable->value().state, counts == 5 ? CommandState::done : CommandState::error)
          << describe(enable->value());
      EXPECT_EQ(rig.state()->state == AxisState::error_stop, counts == 30);
    }
}

/// A handful of random relative moves: nothing is refused, and nothing adds up.
TEST(M30, RandomRelativeMovesDoNotDrift) {
  for (const auto model : closed_loops)
    for (const bool invert : {false, true}) {
      auto options = measured(model, 2);
      options.invert = invert;
      Rig rig(options);
      rig.ready();
      expect_done(rig.complete(MoveAbsoluteRequest{.position = 200}));
      const auto begin = load_of(rig, options);
      std::mt19937 random(7);  // NOLINT(*-msc51-cpp): the same moves each time
      double total = 0;
      for (int i = 0; i < 200; ++i) {
        auto distance = std::uniform_real_distribution(-3.0, 3.0)(random);
        if (i % 3 == 0) distance /= 300;
        if (std::abs(total + distance) > 150) distance = -distance;
        expect_done(rig.complete(MoveRelativeRequest{.distance = distance}));
        total += distance;
        ASSERT_NEAR(load_of(rig, options) - begin, total, 0.0061) << i;
        if (rig.line->wire().size() > 1000) rig.line->forget_wire();
      }
    }
}

/// All three models, both readings of the mode register, plain and inverted.
void with_each_mode(const std::function<void(const RigOptions&)>& test) {
  for (const std::string_view model : {"ykd2405pr", "ssd2608pr", "ess42-r"})
    for (const bool stays : {false, true}) {
      SCOPED_TRACE(std::string(model) + (stays ? " keeps its mode" : " falls back"));
      auto options = measured(model, 1);
      options.switches["mode_stays"] = stays;
      both_directions(options, test);
    }
}

TEST(M10, HomeAndWhatFollowsDoNotDependOnTheModeAtRest) {
  with_each_mode([](const RigOptions& options) {
    Rig rig(options);
    rig.enable();
    for (int i = 0; i < 2; ++i) {
      expect_done(rig.complete(HomeRequest{}));
      EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
      expect_done(rig.complete(MoveAbsoluteRequest{.position = 5}));
      expect_done(rig.complete(MoveRelativeRequest{.distance = 5}));
      EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
    }
    // Homing that is stopped, then a move at once.
    const auto home = rig.submit(HomeRequest{});
    rig.run(700ms);
    expect_done(rig.complete(StopRequest{}));
    EXPECT_TRUE(home->has_ended());
    expect_done(rig.complete(MoveRelativeRequest{.distance = 5}));
    expect_done(rig.complete(DisableRequest{}));
    rig.enable();
    expect_done(rig.complete(HomeRequest{}));
    expect_done(rig.complete(MoveAbsoluteRequest{.position = 1}));
  });
}

TEST(M10, ARestartAfterHomingKeepsThePosition) {
  with_each_mode([](RigOptions options) {
    options.persistence = options.journal = true;
    Rig rig(options);
    rig.enable();
    expect_done(rig.complete(HomeRequest{}));
    rig.stop_daemon();
    rig.start_daemon();
    EXPECT_EQ(rig.state()->trust, PositionTrust::restored);
    expect_done(rig.complete(MoveAbsoluteRequest{.position = 1}));
    EXPECT_NEAR(rig.state()->position, 1, 0.03);
  });
}

TEST(M10, SegmentsOfATerminalLeaveAModeThatProvesNothing) {
  with_each_mode([](RigOptions options) {
    options.adjust = [adjust = options.adjust](AxisSettings& axis) {
      adjust(axis);
      axis.inputs = {{.terminal = "X0", .function = "pt_enable"},
                     {.terminal = "X1", .function = "pin0"},
                     {.terminal = "X2", .function = "negative_limit"}};
      axis.segments = SegmentSettings{.positions = {{.number = 1, .target = 20, .velocity = 20}}};
    };
    // The functions that start motion are written while it is released.
    options.before_start = [](simulation::SimulatedRtuNode& drive, VirtualWorld&) {
      write_register(drive, 0x0029, 0);
    };
    Rig rig(options);
    rig.ready();
    rig.set_input("X1", true);
    rig.run(50ms);
    rig.set_input("X0", true);
    rig.run(100ms);
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->motion_cause == MotionCause::terminal; }, 2s));
    rig.set_input("X0", false);
    rig.set_input("X1", false);
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->state == AxisState::standstill; }, 5s));
    EXPECT_NEAR(rig.state()->position, 20, 0.03);
    expect_done(rig.complete(MoveAbsoluteRequest{.position = 30}));
    expect_done(rig.complete(MoveRelativeRequest{.distance = 1}));
  });
}

}  // namespace
}  // namespace axisd::test
