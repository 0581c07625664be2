// Segments: the drive's own table of motions, started by terminals.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/rules/operate.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

TEST(Segments, ALostFrameNeverLeavesARowThatRunsElsewhere) {
  for (int skip = 0; skip < 12; ++skip) {
    SCOPED_TRACE(skip);
    Rig rig({.switches = {{"enabled_at_power_up", false}}, .adjust = [](AxisSettings& axis) {
               axis.inputs.insert(axis.inputs.end(), {{.terminal = "X3", .function = "pt_enable"},
                                                      {.terminal = "X4", .function = "pin0"}});
             }});
    const auto write_table = [&](double target) {
      return operate<SegmentSettings>(rig, [target](const DriveOperations& drive) {
        return drive.write_segments(
            {.positions = {{.number = 1, .target = target, .velocity = 50, .acceleration_time = 50ms}}});
      });
    };
    ASSERT_TRUE(write_table(60));
    rig.fault({.kind = simulation::FaultKind::drop_request, .function = 0x06, .skip = skip, .count = 100});
    const bool whole = write_table(-7).has_value();
    rig.faults().clear();
    rig.reconnect();
    rig.enable();
    rig.set_input("X4", true);
    rig.run(50ms);
    rig.set_input("X3", true);
    rig.run(5s);
    const auto went = rig.load_mm();
    EXPECT_TRUE(std::abs(went) < 0.01 || std::abs(went - 60) < 0.01 || std::abs(went + 7) < 0.01) << went;
    if (whole) EXPECT_NEAR(went, -7, 0.01);
  }
}

TEST(Segments, AbsoluteOnesLeaveNoOtherPositionThanHome) {
  Rig rig({.adjust =
               [](AxisSettings& axis) {
                 axis.segments = SegmentSettings{.absolute = true,
                                                 .positions = {{.number = 1, .target = 20, .velocity = 50}}};
               },
           .connect = false});
  rig.run(1s);
  rig.complete(DisableRequest{});
  rig.reconnect();
  rig.enable();
  EXPECT_EQ(rig.try_submit(SetPositionRequest{.position = 30}).error().reason, Reason::not_supported);
}

TEST(Segments, AMotionThatTerminalsStartIsTheDrivesOwn) {
  both_directions({}, [](const RigOptions& base) {
    auto options = base;
    options.adjust = [](AxisSettings& axis) {
      axis.inputs.insert(axis.inputs.end(), {{.terminal = "X3", .function = "pt_enable"},
                                             {.terminal = "X4", .function = "pin0"},
                                             {.terminal = "X5", .function = "pin1"}});
      axis.segments = SegmentSettings{
          .positions = {{.number = 2, .target = 20, .velocity = 50, .acceleration_time = 100ms}}};
    };
    options.connect = false;
    options.switches["enabled_at_power_up"] = false;
    Rig rig(options);
    rig.reconnect();
    rig.ready();
    rig.set_input("X5", true);
    rig.run(100ms);
    rig.set_input("X3", true);
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->state == AxisState::discrete_motion; }, 1s));
    EXPECT_EQ(rig.state()->motion_cause, MotionCause::terminal);
    EXPECT_EQ(rig.try_submit(MoveRelativeRequest{.distance = 1}).error().reason, Reason::terminal);
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->state == AxisState::standstill; }, 5s));
    EXPECT_EQ(rig.state()->motion_cause, MotionCause::none);
    EXPECT_NEAR(rig.state()->position, 20, 0.01);
    EXPECT_NEAR(rig.load_mm(), 20, 0.01);
    EXPECT_EQ(rig.drive->starts(), 1);
    EXPECT_EQ(rig.triggers(), 0) << "nothing of it came over the wire";
  });
}

}  // namespace
}  // namespace axisd::test
