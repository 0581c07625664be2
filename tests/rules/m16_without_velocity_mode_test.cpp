// M16 and M23 on a CiA 402 drive without profile velocity mode: it goes to positions, and nothing of what a
// stop interrupted goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "buses/canopen/eds.hpp"
#include "devices/cia402_eds/overrides.hpp"
#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Lack {
  std::string why;  ///< part of the refusal
  std::map<std::string, SettingValue> objects;
  bool homes = true;
};

const std::vector<Lack>& lacks() {
  static const std::vector<Lack> all{
      {"object 60FFh:00 (target velocity) is missing", {{"objects.60FFh:00.access", std::string("none")}}},
      {"by object 6502h:00 the drive has no profile velocity mode",
       {{"objects.6502h:00.default", std::int64_t{0x21}}}},
      {"object 60FFh:00 (target velocity) is missing",
       {{"objects.60FFh:00.access", std::string("none")}, {"objects.6098h:00.access", std::string("none")}},
       false}};
  return all;
}

/// The drive lacks it, and its file says so.
CanRigOptions rig_of(const Lack& lack, bool invert = false) {
  auto settings = lack.objects;
  settings["eds"] = in_source_tree("config/examples/standard-drive.eds");
  settings["velocity_unit"] = std::string("pulses_per_second");
  CanRigOptions options{.model = "cia402", .invert = invert};
  options.adjust_drive = [settings](simulation::SimulatedNodeSettings& drive) {
    auto sheet = canopen::load_eds(in_source_tree("config/examples/standard-drive.eds"));
    if (!sheet) throw std::runtime_error(to_string(sheet.error()));
    (void)cia402_eds::apply_overrides(cia402_eds::overrides_of(settings), *sheet);
    drive.sheet = std::make_shared<const canopen::Eds>(*std::move(sheet));
  };
  options.adjust = [settings, homes = lack.homes](AxisSettings& axis) {
    const auto* model = find_drive_model("cia402");
    auto made = model->specialise(*model, settings);
    if (!made) throw std::invalid_argument(to_string(made.error()));
    axis.own_descriptor = *made;
    axis.model_settings = settings;
    if (!homes) axis.homing.reset();
  };
  return options;
}

void expect_no_velocity_mode(const CanRig& rig) {
  EXPECT_THAT(rig.writes_of(0x60FF00), IsEmpty());
  for (const auto mode : rig.writes_of(0x606000)) EXPECT_NE(mode & 0xFFU, 3U);
}

TEST(M16, WithoutVelocityModeADriveGoesToPositions) {
  for (const auto& lack : lacks())
    for (const bool invert : {false, true}) {
      SCOPED_TRACE(lack.why);
      CanRig rig(rig_of(lack, invert));
      rig.ready();
      for (const double position : {120.0, 0.0, 37.5}) {
        rig.done(MoveAbsoluteRequest{.position = position});
        EXPECT_NEAR(static_cast<double>(rig.shaft()), (invert ? -100 : 100) * position, 3);
      }
      rig.done(DisableRequest{});
      rig.done(EnableRequest{});
      rig.done(MoveRelativeRequest{.distance = 5});
      EXPECT_NEAR(static_cast<double>(rig.shaft()), (invert ? -100 : 100) * 42.5, 5);
      expect_no_velocity_mode(rig);
    }
}

TEST(M23, WithoutVelocityModeNothingGoesOnThatAStopInterrupted) {
  for (const auto& lack : lacks())
    for (const auto kind : {StopKind::halt, StopKind::stop, StopKind::quick_stop}) {
      SCOPED_TRACE(lack.why);
      CanRig rig(rig_of(lack));
      rig.ready();
      for (const bool released : {false, true}) {
        rig.submit(MoveAbsoluteRequest{.position = 300});
        rig.run(1s);
        rig.done(StopRequest{.kind = kind});
        const auto stopped = rig.shaft();
        EXPECT_GT(stopped, 1000);
        if (released) {
          rig.done(DisableRequest{});
          rig.done(EnableRequest{});
        }
        rig.run(500ms);
        EXPECT_NEAR(static_cast<double>(rig.shaft()), static_cast<double>(stopped), 3);
        const auto back = rig.submit(MoveAbsoluteRequest{.position = 0});
        auto farthest = stopped;
        for (int ms = 0; ms < 10'000 && !back->has_ended(); ++ms) {
          rig.run(1ms);
          farthest = std::max(farthest, rig.shaft());
        }
        EXPECT_EQ(back->value().state, CommandState::done) << describe(back->value());
        EXPECT_LE(farthest, stopped + 3) << "the end of the halt let it go on";
        EXPECT_NEAR(static_cast<double>(rig.shaft()), 0, 5);
      }
      expect_no_velocity_mode(rig);
    }
}

/// CiA 402: 0 may be no mode, and may be no change of it.
TEST(M23, ADriveThatStaysInItsModeIsNeitherEnabledNorMovedAfterAStop) {
  for (const bool stopped : {false, true}) {
    auto options = rig_of(lacks().back());
    options.switches["no_mode_changes_nothing"] = true;
    CanRig rig(std::move(options));
    rig.ready();  // as it comes up, in no mode
    if (stopped) {
      rig.submit(MoveAbsoluteRequest{.position = 300});
      rig.run(1s);
      rig.done(StopRequest{});
    } else {
      rig.done(MoveAbsoluteRequest{.position = 20});
      rig.done(DisableRequest{});
    }
    rig.run(500ms);
    const auto at = rig.shaft();
    const auto starts = rig.drive->starts();
    const auto refused = rig.complete(stopped ? Action(MoveAbsoluteRequest{}) : Action(EnableRequest{}));
    EXPECT_EQ(refused.state, CommandState::error) << describe(refused);
    ASSERT_TRUE(refused.cause);
    EXPECT_THAT(refused.cause->message, HasSubstr("stays in mode 1 instead of 0: it cannot rest in no mode"));
    EXPECT_THAT(refused.cause->remedy, HasSubstr("drive: { objects: ... }"));
    rig.run(2s);
    EXPECT_EQ(rig.drive->starts(), starts);
    EXPECT_NEAR(static_cast<double>(rig.shaft()), static_cast<double>(at), 3);
  }
}

TEST(M16, WithoutVelocityModeJogsAndVelocityMovesAreRefused) {
  for (const auto& lack : lacks())
    for (const bool limits : {true, false}) {
      SCOPED_TRACE(lack.why);
      auto options = rig_of(lack);
      options.limits = limits;
      CanRig rig(std::move(options));
      rig.ready();
      const auto starts = rig.drive->starts();
      for (const Action& action :
           {Action(JogRequest{.velocity = 5}), Action(MoveVelocityRequest{.velocity = 5}),
            Action(MoveVelocityRequest{.velocity = -5})}) {
        const auto refused = rig.machine->submit("feeder", action, {});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().reason, Reason::not_supported);
        EXPECT_THAT(refused.error().message, HasSubstr(lack.why));
        EXPECT_THAT(refused.error().remedy, HasSubstr("axisctl move feeder"));
        const auto explained = rig.axis().explain(action, {});
        EXPECT_TRUE(std::ranges::any_of(explained, [&](const Obstacle& one) {
          return one.blocking && one.error.message == refused.error().message;
        })) << "Explain says the same";
      }
      EXPECT_TRUE(std::ranges::any_of(rig.axis().explain(std::nullopt, {}), [&](const Obstacle& one) {
        return !one.blocking && one.error.reason == Reason::not_supported;
      })) << "before anything is asked for";
      const auto move = rig.submit(MoveAbsoluteRequest{.position = 20});
      const auto waiting = rig.machine->submit("feeder", MoveVelocityRequest{.velocity = 5},
                                               {.buffer_mode = BufferMode::buffered});
      ASSERT_FALSE(waiting);
      EXPECT_EQ(waiting.error().reason, Reason::not_supported) << to_string(waiting.error());
      rig.run(3s);
      EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
      EXPECT_EQ(rig.drive->starts(), starts + 1);
    }
}

TEST(M21, WithoutVelocityModeADriveHomes) {
  for (const auto& lack : lacks()) {
    if (!lack.homes) continue;
    SCOPED_TRACE(lack.why);
    CanRig rig(rig_of(lack));
    rig.done(EnableRequest{});
    const auto interrupted = rig.submit(HomeRequest{});
    rig.run(500ms);
    rig.done(StopRequest{});
    EXPECT_EQ(interrupted->value().state, CommandState::aborted) << describe(interrupted->value());
    const auto stopped = rig.shaft();
    rig.run(500ms);
    EXPECT_NEAR(static_cast<double>(rig.shaft()), static_cast<double>(stopped), 3) << "nothing goes on";
    for (int i = 0; i < 2; ++i) {
      rig.done(HomeRequest{});
      EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
      rig.done(MoveAbsoluteRequest{.position = 10});
    }
    expect_no_velocity_mode(rig);
  }
}

/// The quick stop goes by way of homing mode while the motor turns, and nothing homes.
TEST(M20, WithoutVelocityModeAQuickStopUnderAHaltKeepsThePosition) {
  for (const auto& lack : lacks())
    for (const auto first : {StopKind::halt, StopKind::stop}) {
      SCOPED_TRACE(lack.why);
      CanRig rig(rig_of(lack));
      rig.ready();
      for (const double target : {300.0, 390.0}) {
        rig.submit(MoveAbsoluteRequest{.position = target, .with = {.acceleration_time = 600ms}});
        rig.run(900ms);
        rig.submit(StopRequest{.kind = first});
        rig.run(50ms);
        EXPECT_TRUE(rig.drive->shaft_moving());
        const auto modes = rig.writes_of(0x606000).size();
        const auto quick = rig.submit(StopRequest{.kind = StopKind::quick_stop});
        rig.run(20ms);
        rig.done(
            StopRequest{.kind = StopKind::quick_stop});  // once more in the mode that the first one chose
        EXPECT_GT(rig.writes_of(0x606000).size(), modes) << "not by way of another mode";
        EXPECT_TRUE(quick->has_ended());
        EXPECT_EQ(rig.state()->trust, PositionTrust::set);
        EXPECT_NEAR(rig.state()->position, static_cast<double>(rig.shaft()) / 100, 0.2);
      }
      rig.run(500ms);
      rig.done(MoveAbsoluteRequest{.position = 5});
      EXPECT_EQ(rig.state()->trust, PositionTrust::set);
      EXPECT_NEAR(static_cast<double>(rig.shaft()), 500, 5);
    }
}

/// What homing mode shows of the homing before says nothing where a start or a stop only passes through it.
TEST(M20, WithoutVelocityModeAHomedDriveKeepsItsPositionOverARestart) {
  for (const auto& lack : lacks())
    for (const bool polled : {false, true}) {
      if (!lack.homes) continue;
      SCOPED_TRACE(lack.why);
      auto options = rig_of(lack);
      options.persistence = options.journal = true;
      options.polled = polled;
      CanRig rig(std::move(options));
      rig.done(EnableRequest{});
      rig.done(HomeRequest{});
      rig.done(MoveAbsoluteRequest{.position = 10});
      const auto at = rig.shaft();
      for (const bool released : {false, true}) {
        rig.stop_daemon();
        rig.start_daemon();
        ASSERT_EQ(rig.state()->trust, PositionTrust::restored);
        if (released) rig.done(DisableRequest{});
        rig.done(EnableRequest{});
        rig.done(StopRequest{});
        rig.run(1s);
        EXPECT_EQ(rig.state()->trust, PositionTrust::restored);
        rig.submit(MoveAbsoluteRequest{.position = 300, .with = {.acceleration_time = 500ms}});
        rig.run(1s);
        rig.submit(StopRequest{.kind = StopKind::halt});
        rig.run(50ms);
        rig.done(StopRequest{.kind = StopKind::quick_stop});
        rig.run(1s);
        rig.done(MoveAbsoluteRequest{.position = 10});
        EXPECT_EQ(rig.state()->trust, PositionTrust::restored);
        EXPECT_NEAR(static_cast<double>(rig.shaft()), static_cast<double>(at), 5);
      }
    }
}

}  // namespace
}  // namespace axisd::test
