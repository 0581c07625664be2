// M10, M11 and M13 where a count of velocity is much: what is slower than one reads 0, and cannot be asked
// for.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "buses/canopen/eds.hpp"
#include "devices/cia402_eds/overrides.hpp"
#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// An open loop whose velocities count whole revolutions per second (60A9h), with ramps of a second: for the
/// first and the last 50 ms of a motion 606Ch reads 0.
CanRigOptions whole_turns() {
  const std::map<std::string, SettingValue> settings{
      {"eds", in_source_tree("config/examples/standard-drive.eds")},
      {"loop_mode", std::string("open")},
      {"objects.60A9h:00.type", std::string("u32")},
      {"objects.60A9h:00.access", std::string("ro")},
      {"objects.60A9h:00.default", std::int64_t{0x00B40300}}};
  CanRigOptions options{.model = "cia402", .encoder = {}};
  options.adjust_drive = [settings](simulation::SimulatedNodeSettings& drive) {
    auto sheet = canopen::load_eds(in_source_tree("config/examples/standard-drive.eds"));
    if (!sheet) throw std::runtime_error(to_string(sheet.error()));
    (void)cia402_eds::apply_overrides(cia402_eds::overrides_of(settings), *sheet);
    drive.sheet = std::make_shared<const canopen::Eds>(*std::move(sheet));
  };
  options.adjust = [settings](AxisSettings& axis) {
    const auto* model = find_drive_model("cia402");
    auto made = model->specialise(*model, settings);
    if (!made) throw std::invalid_argument(to_string(made.error()));
    axis.own_descriptor = *made;
    axis.model_settings = settings;
    axis.homing.reset();  // slower than five counts
    axis.limits.acceleration_time = 1s;
  };
  return options;
}

TEST(M10, AMotionThatReadsNoVelocityIsNotOver) {
  for (const bool invert : {false, true}) {
    auto options = whole_turns();
    options.invert = invert;
    CanRig rig(std::move(options));
    rig.ready();
    for (const double position : {300.0, 0.0, 17.0, 60.0}) {
      rig.done(MoveAbsoluteRequest{.position = position});
      EXPECT_EQ(rig.shaft(), std::lround((invert ? -100 : 100) * position));
      EXPECT_FALSE(rig.drive->shaft_moving());
    }
  }
}

TEST(M13, AShaftThatReadsNoVelocityIsNotAtStandstill) {
  CanRig rig(whole_turns());
  rig.ready();
  for (auto after = 600ms; after < 700ms; after += 7ms) {
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(after);
    rig.done(StopRequest{.kind = StopKind::stop});
    (void)rig.shaft();
    EXPECT_FALSE(rig.drive->shaft_moving()) << after.count();
    EXPECT_TRUE(move->has_ended());
    rig.done(MoveAbsoluteRequest{.position = 0});
  }
}

/// 1 r/min of 10 increments per revolution is a sixth of one per second.
TEST(M11, AVelocityOfLessThanOneCountIsNeverSent) {
  CanRig rig({.model = "cia402", .encoder = {}, .limits = false, .adjust = [](AxisSettings& axis) {
                axis.scale.pulses_per_revolution = 10;
              }});
  rig.done(EnableRequest{});
  const auto starts = rig.drive->starts();
  const Action slow[] = {MoveRelativeRequest{.distance = 50, .with = {.velocity = 0.2}},
                         MoveVelocityRequest{.velocity = 0.2}, MoveVelocityRequest{.velocity = -0.2}};
  for (const auto& action : slow) {
    const auto command = rig.complete(action);
    EXPECT_EQ(command.state, CommandState::error) << describe(command);
    ASSERT_TRUE(command.cause);
    EXPECT_EQ(command.cause->reason, Reason::out_of_range) << to_string(*command.cause);
    EXPECT_EQ(rig.state()->state, AxisState::standstill);
  }
  EXPECT_EQ(rig.drive->starts(), starts);
}

}  // namespace
}  // namespace axisd::test
