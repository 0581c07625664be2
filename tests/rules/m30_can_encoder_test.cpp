// Closed-loop drives on CAN with an encoder as it really is (M10, M19, M20, M23, M30): what is measured
// wavers, lags and settles late, and velocities waver, too.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// One count of the encoder and the in-position window (10 counts), in mm.
struct Gauge {
  double pulses_per_mm, count, window;
};
/// yss-c: 10000 pulses and 4000 counts per revolution; cia402: 1000 counts, which are its pulses.
Gauge gauge_of(const CanRigOptions& options) {
  return options.model == "yss-c" ? Gauge{1000, 0.0025, 0.025} : Gauge{100, 0.01, 0.1};
}

CanRigOptions measured(const std::string& model, int noise) {
  CanRigOptions options{.model = model};
  options.encoder = {.noise = noise, .following = 8ms, .quantised = true, .compliance = 10};
  const bool fine = model == "yss-c";
  options.adjust = [fine](AxisSettings& axis) {
    axis.jog_travel = 10;
    axis.homing->method = HomingMethod::negative_limit;
    axis.homing->position = -60;
    axis.homing->max_travel = 600;
    if (fine) axis.scale.pulses_per_revolution = 10'000;
  };
  options.adjust_drive = [fine](simulation::SimulatedNodeSettings& node) {
    if (!fine) return;
    node.eeprom[0x200600] = 13;
    for (auto* position : {&node.mechanics.home_switch_from, &node.mechanics.home_switch_to,
                           &node.mechanics.positive_limit_from, &node.mechanics.negative_limit_from})
      if (*position) **position *= 10;
  };
  return options;
}

/// Both models, noise of 0, 1 and 2 counts, plain and inverted; the state by event, with each SYNC, by SDO.
void on_each(const std::function<void(const CanRigOptions&)>& test) {
  for (const std::string model : {"yss-c", "cia402"})
    for (const int noise : {0, 1, 2})
      for (const bool invert : {false, true})
        for (const char* by : {"event", "sync", "sdo"}) {
          if (noise < 2 && by != std::string("event")) continue;
          SCOPED_TRACE(model + " noise " + std::to_string(noise) + (invert ? " inverted by " : " by ") + by);
          auto options = measured(model, noise);
          options.invert = invert;
          if (by == std::string("sync")) options.sync_period = 10ms;
          options.polled = by == std::string("sdo");
          test(options);
        }
}

/// As another master does.
void send_behind(simulation::SimulatedCanNode& node, const std::array<std::uint8_t, 8>& sdo) {
  node.on_frame(can::make_frame(0x600U + CanRig::node_id, sdo));
}

double load_of(CanRig& rig, const CanRigOptions& options) {
  return static_cast<double>(rig.shaft()) / gauge_of(options).pulses_per_mm * (options.invert ? -1 : 1);
}

/// Where the load may be beside where it should: the base is one reading, and all is rounded to pulses.
double slack_of(const CanRigOptions& options) {
  const auto gauge = gauge_of(options);
  return 2 * gauge.count + 1.1 / gauge.pulses_per_mm;
}

TEST(M30, OnCanEverythingWorksOnAMeasuredPosition) {
  on_each([](const CanRigOptions& options) {
    const auto slack = slack_of(options);
    CanRig rig(options);
    rig.ready();
    const auto zero = load_of(rig, options);
    rig.done(MoveAbsoluteRequest{.position = 100});
    EXPECT_NEAR(load_of(rig, options) - zero, 100, slack);
    EXPECT_NEAR(rig.state()->position, 100, gauge_of(options).window + slack);
    rig.done(MoveRelativeRequest{.distance = -30});
    EXPECT_NEAR(load_of(rig, options) - zero, 70, slack);
    const auto jog = rig.submit(JogRequest{.velocity = 20, .hold = 200ms});
    EXPECT_TRUE(rig.run_until([&] { return jog->has_ended(); }, 5s));
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->state == AxisState::standstill; }, 5s));
    rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(500ms);
    rig.done(StopRequest{});
    rig.done(DisableRequest{});
    rig.done(EnableRequest{});
    EXPECT_EQ(rig.state()->trust, PositionTrust::set);
    rig.done(MoveAbsoluteRequest{.position = 10});
    EXPECT_NEAR(load_of(rig, options) - zero, 10, slack);
    const auto reboots = rig.state()->reboots;
    for (int i = 0; i < 50; ++i) {
      rig.run(100ms);
      EXPECT_EQ(rig.state()->state, AxisState::standstill);
    }
    EXPECT_EQ(rig.state()->reboots, reboots);
    EXPECT_EQ(rig.state()->trust, PositionTrust::set);
  });
}

/// At the end of the profile the shaft is still 30 counts and more behind.
TEST(M30, OnCanDoneIsWithinTheDrivesWindowAndNotBeforeItHasSettled) {
  for (const std::string model : {"yss-c", "cia402"})
    for (const bool polled : {false, true}) {
      auto options = measured(model, 1);
      options.encoder.following = 40ms;
      options.polled = polled;
      CanRig rig(options);
      rig.ready();
      rig.done(MoveAbsoluteRequest{.position = 50});
      const auto gauge = gauge_of(options);
      EXPECT_NEAR(rig.state()->position, 50, gauge.window + gauge.count);
    }
}

TEST(M30, OnCanASlowMotionIsOne) {
  for (const auto rpm : {1.0, 2.0, 3.0})
    for (const int noise : {0, 2}) {
      auto options = measured("cia402", noise);
      SCOPED_TRACE(std::to_string(rpm) + " r/min, noise " + std::to_string(noise));
      CanRig rig(options);
      rig.ready();
      const auto zero = load_of(rig, options);
      rig.done(MoveRelativeRequest{.distance = 2, .with = {.velocity = rpm / 6}});
      EXPECT_NEAR(load_of(rig, options) - zero, 2, slack_of(options));
    }
}

/// 606Fh: 6 r/min here. Its velocities at rest are as far off, as with a coarse encoder.
TEST(M30, OnCanTheDrivesOwnVelocityThresholdIsNoise) {
  for (const int noise : {1, 2}) {
    auto options = measured("cia402", noise);
    options.switches = {{"velocity_wavers_by_threshold", true}};
    const auto slack = slack_of(options);
    CanRig rig(options);
    rig.ready();
    const auto zero = load_of(rig, options);
    rig.done(MoveAbsoluteRequest{.position = 100});
    rig.done(MoveRelativeRequest{.distance = 2, .with = {.velocity = 0.5}});  // 3 r/min
    EXPECT_NEAR(load_of(rig, options) - zero, 102, slack);
    const auto jog = rig.submit(JogRequest{.velocity = 20, .hold = 200ms});
    EXPECT_TRUE(rig.run_until([&] { return jog->has_ended(); }, 5s));
    rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(500ms);
    rig.done(StopRequest{});
    rig.done(DisableRequest{});
    rig.done(EnableRequest{});
    for (int i = 0; i < 50; ++i) {
      rig.run(100ms);
      EXPECT_EQ(rig.state()->state, AxisState::standstill);
      EXPECT_EQ(rig.state()->velocity, 0);
    }
  }
}

TEST(M30, OnCanWhatDoesNotArriveIsNotDone) {
  on_each([](const CanRigOptions& options) {
    CanRig rig(options);
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 50});
    rig.run(300ms);
    // Another master stops it.
    rig.touch([](auto& node) { send_behind(node, {0x2B, 0x40, 0x60, 0, 0x0F, 0x01, 0, 0}); });
    ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 10s));
    EXPECT_EQ(move->value().state, CommandState::error) << describe(move->value());
    ASSERT_TRUE(move->value().cause);
    EXPECT_EQ(move->value().cause->reason, Reason::not_reached);
  });
}

TEST(M30, OnCanMovesSmallerThanTheWindowAreMade) {
  on_each([](const CanRigOptions& options) {
    const auto pulse = 1 / gauge_of(options).pulses_per_mm;
    CanRig rig(options);
    rig.ready();
    const auto zero = load_of(rig, options);
    for (int i = 1; i <= 12; ++i) {
      rig.done(MoveRelativeRequest{.distance = 2 * pulse});
      EXPECT_NEAR(load_of(rig, options) - zero, i * 2 * pulse, slack_of(options)) << i;
    }
    for (int i = 11; i >= 0; --i) rig.done(MoveRelativeRequest{.distance = -2 * pulse});
    EXPECT_NEAR(load_of(rig, options) - zero, 0, slack_of(options));
  });
}

TEST(M30, OnCanHomeEndsDoneAndAgain) {
  on_each([](const CanRigOptions& options) {
    CanRig rig(options);
    rig.done(EnableRequest{});
    double home = 0;
    for (int i = 0; i < 2; ++i) {
      rig.done(HomeRequest{});
      EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
      if (i == 0) home = load_of(rig, options);
      rig.done(MoveAbsoluteRequest{.position = 20});
      EXPECT_NEAR(load_of(rig, options) - home, 80, 1.1 / gauge_of(options).pulses_per_mm)
          << "the origin is the drive's, not one reading";
    }
  });
}

TEST(M30, OnCanARestartOfTheDaemonFindsItWhereItWas) {
  on_each([](CanRigOptions options) {
    options.persistence = options.journal = true;
    CanRig rig(options);
    rig.ready();
    rig.done(MoveAbsoluteRequest{.position = 40});
    const auto at = load_of(rig, options);
    for (int i = 0; i < 3; ++i) {
      rig.stop_daemon();
      rig.run(77ms);
      rig.start_daemon();
      EXPECT_EQ(rig.state()->trust, PositionTrust::restored);
      EXPECT_NEAR(rig.state()->position, 40, gauge_of(options).window);
    }
    rig.done(MoveAbsoluteRequest{.position = 50});
    EXPECT_NEAR(load_of(rig, options) - at, 10, slack_of(options));
  });
}

/// Within its window it may give way to the load; beyond, something turns it.
TEST(M30, OnCanOnlyAShaftThatTurnsFurtherThanItsWindowHasMovedWhenItWasEnabled) {
  for (const std::string model : {"yss-c", "cia402"})
    for (const bool polled : {false, true})
      for (const int counts : {5, 30}) {
        SCOPED_TRACE(model + " " + std::to_string(counts));
        auto options = measured(model, 2);
        options.encoder.compliance = 40;
        options.polled = polled;
        CanRig rig(options);
        rig.done(DisableRequest{});
        const auto enable = rig.submit(EnableRequest{});
        const auto energised = [&] {
          bool leant = false;
          rig.touch([&](auto& node) { leant = node.lean_on_shaft(counts); });
          return leant;
        };
        ASSERT_TRUE(rig.run_until(energised, 1s));
        ASSERT_TRUE(rig.run_until([&] { return enable->has_ended(); }, 5s));
        EXPECT_EQ(enable->value().state, counts == 5 ? CommandState::done : CommandState::error)
            << describe(enable->value());
        EXPECT_EQ(rig.state()->state == AxisState::error_stop, counts == 30);
      }
}

/// M23: 3 r/min are less than the window while it is watched, and yet a motion.
/// 3 r/min. Where the drive's own threshold is beyond that, Enable may end before the turn is told from
/// noise.
void turn_slowly_while_enabled(int noise, std::uint32_t threshold) {
  auto options = measured("cia402", noise);
  options.adjust_drive = [threshold](simulation::SimulatedNodeSettings& node) {
    node.eeprom[0x606F00] = threshold;
  };
  CanRig rig(options);
  rig.done(DisableRequest{});
  const auto enable = rig.submit(EnableRequest{});
  // Until it falls between two requests of the daemon.
  const auto starts_it = [&] {
    rig.touch([&](auto& node) {
      if ((node.peek(0x604100) & 0x6FU) != 0x27U || node.shaft_moving()) return;
      const auto acceleration = node.peek(0x608300);
      node.poke(0x608300, 100'000);
      node.poke(0x60FF00, 50);  // 3 r/min
      send_behind(node, {0x2F, 0x60, 0x60, 0, 3, 0, 0, 0});
      node.poke(0x608300, acceleration);
    });
    return rig.drive->shaft_moving();
  };
  ASSERT_TRUE(rig.run_until(starts_it, 1s));
  ASSERT_FALSE(enable->has_ended());
  const auto from = rig.shaft();
  ASSERT_TRUE(rig.run_until([&] { return enable->has_ended(); }, 5s));
  if (threshold == 0) {
    EXPECT_EQ(enable->value().state, CommandState::error) << describe(enable->value());
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->state == AxisState::error_stop; }, 5s));
  }
  EXPECT_TRUE(rig.run_until([&] { return !rig.drive->shaft_moving(); }, 5s));
  EXPECT_LT(std::abs(rig.shaft() - from), 20) << "counts, two in-position windows";
}

TEST(M30, OnCanASlowTurnOfAnEnabledShaftIsFound) {
  for (const int noise : {0, 1})
    for (const std::uint32_t threshold : {0, 100}) {
      SCOPED_TRACE(std::to_string(noise) + ' ' + std::to_string(threshold));
      turn_slowly_while_enabled(noise, threshold);
    }
}

/// M16: whichever of its readings is the last.
TEST(M30, OnCanAtTheSoftwareLimitNothingIsLeftToGo) {
  for (const std::string model : {"yss-c", "cia402"})
    for (const bool moved_there : {false, true}) {
      CanRig rig(measured(model, 2));
      rig.ready();
      if (moved_there)
        rig.done(MoveAbsoluteRequest{.position = 400});
      else
        EXPECT_EQ(rig.complete(MoveVelocityRequest{.velocity = 80}).state, CommandState::aborted);
      for (int i = 0; i < 20; ++i) {
        rig.run(17ms);
        const auto again = rig.machine->submit("feeder", MoveVelocityRequest{.velocity = 10}, {});
        ASSERT_FALSE(again) << i;
        EXPECT_EQ(again.error().reason, Reason::soft_limit);
      }
    }
}

TEST(M30, OnCanRandomRelativeMovesDoNotDrift) {
  for (const std::string model : {"yss-c", "cia402"})
    for (const bool invert : {false, true}) {
      auto options = measured(model, 2);
      options.invert = invert;
      CanRig rig(options);
      rig.ready();
      rig.done(MoveAbsoluteRequest{.position = 200});
      const auto begin = load_of(rig, options);
      std::mt19937 random(7);  // NOLINT(*-msc51-cpp): the same moves each time
      double total = 0;
      for (int i = 0; i < 100; ++i) {
        auto distance = std::uniform_real_distribution(-3.0, 3.0)(random);
        if (i % 3 == 0) distance /= 300;
        if (std::abs(total + distance) > 150) distance = -distance;
        rig.done(MoveRelativeRequest{.distance = distance});
        total += distance;
        ASSERT_NEAR(load_of(rig, options) - begin, total, slack_of(options)) << i;
        rig.frames.clear();
      }
    }
}

/// M19: somebody turns the shaft while it is released.
TEST(M19, OnCanAShaftTurnedWhileReleasedIsTheNewBase) {
  on_each([](const CanRigOptions& options) {
    const auto gauge = gauge_of(options);
    const auto turn = [&](CanRig& rig, double mm) {
      bool turned = false;
      rig.touch([&](auto& node) {
        turned = node.push_shaft(std::llround(mm * gauge.pulses_per_mm) * (options.invert ? -1 : 1));
      });
      ASSERT_TRUE(turned);
    };
    const auto expect_moves = [&](CanRig& rig, double mm) {
      const auto before = load_of(rig, options);
      rig.done(MoveRelativeRequest{.distance = mm});
      EXPECT_NEAR(load_of(rig, options) - before, mm, slack_of(options));
    };
    CanRig rig(options);
    rig.ready();
    rig.done(DisableRequest{});
    rig.done(SetPositionRequest{.position = 200});
    turn(rig, 150);
    rig.done(EnableRequest{});
    expect_moves(rig, 1);
    expect_moves(rig, -1);
    rig.done(MoveAbsoluteRequest{.position = 300});
    rig.done(DisableRequest{});
    turn(rig, -100);
    rig.done(EnableRequest{});
    expect_moves(rig, 1);
  });
}

/// Where the drive tells both, they are of one moment.
TEST(M30, OnCanTheCommandedPositionIsShownBesideTheMeasuredOne) {
  for (const bool polled : {false, true}) {
    auto options = measured("cia402", 1);
    options.invert = true;
    options.polled = polled;
    CanRig rig(options);
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 100, .with = {.velocity = 50}});
    rig.run(1s);
    ASSERT_FALSE(move->has_ended());
    if (!polled) {
      ASSERT_TRUE(rig.state()->commanded_position);
      EXPECT_NEAR(*rig.state()->following_error, 50 * 0.008, 0.05) << "its time constant is 8 ms";
    }
    ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 10s));
    rig.run(1s);
    ASSERT_TRUE(rig.state()->commanded_position);
    EXPECT_NEAR(*rig.state()->commanded_position, 100, 0.021);
    EXPECT_NEAR(*rig.state()->following_error, 0, 0.021);
  }
}

}  // namespace
}  // namespace axisd::test
