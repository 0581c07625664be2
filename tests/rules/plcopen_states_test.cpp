// What PLCopen part 1 says of states, where the rules of motion name no number of their own for it (M14), and
// what a limit switch leaves of a measured position (M20).
#include <gtest/gtest.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// MC_Halt is a motion that ends at velocity zero.
TEST(PlcopenStates, AHaltShowsDiscreteMotionUntilItRests) {
  const Action motions[] = {MoveVelocityRequest{.velocity = 50}, JogRequest{.velocity = 50, .hold = 2s},
                            MoveAbsoluteRequest{.position = 300}};
  for (const auto& motion : motions) {
    Rig rig;
    rig.ready();
    rig.submit(motion);
    rig.run(500ms);
    const auto halt = rig.submit(StopRequest{.kind = StopKind::halt});
    while (!halt->has_ended()) {
      EXPECT_EQ(rig.state()->state, AxisState::discrete_motion);
      rig.run(5ms);
    }
    EXPECT_EQ(rig.state()->state, AxisState::standstill);
  }
}

TEST(PlcopenStates, AnExpiredJogShowsDiscreteMotionUntilItRests) {
  Rig rig;
  rig.ready();
  const auto jog = rig.submit(JogRequest{.velocity = 50, .hold = 200ms});
  ASSERT_TRUE(rig.run_until([&] { return jog->has_ended(); }, 1s));
  EXPECT_EQ(jog->value().state, CommandState::aborted);
  EXPECT_EQ(jog->value().cause->reason, Reason::expired);
  EXPECT_EQ(rig.state()->state, AxisState::discrete_motion);
  rig.run(1s);
  EXPECT_EQ(rig.state()->state, AxisState::standstill);
}

TEST(PlcopenStates, AHaltAtRestShowsStandstill) {
  Rig rig;
  rig.ready();
  rig.submit(StopRequest{.kind = StopKind::halt});
  EXPECT_EQ(rig.state()->state, AxisState::standstill);
}

/// An encoder goes on counting where the ramp is missing.
TEST(M20, AMeasuredPositionSurvivesALimitSwitch) {
  for (const auto* model : {"ess42-r", "ssd2608pr"})
    for (const auto* terminal : {"X1", "X2"})
      for (const bool active_low : {false, true}) {
        RigOptions base{.model = model, .adjust = [active_low](AxisSettings& axis) {
                          axis.homing.reset();
                          for (auto& input : axis.inputs) input.active_low = active_low;
                        }};
        both_directions(base, [&](const RigOptions& options) {
          Rig rig(options);
          rig.ready();
          const bool positive = terminal == std::string_view("X1");
          rig.complete(SetPositionRequest{.position = 200});
          const auto move = rig.submit(MoveAbsoluteRequest{.position = positive ? 300.0 : 100.0});
          rig.run(500ms);
          ASSERT_FALSE(move->has_ended()) << describe(move->value());
          rig.set_input(terminal, !active_low);
          rig.run(2s);
          EXPECT_EQ(move->value().cause->reason, Reason::limit_switch) << describe(move->value());
          EXPECT_EQ(rig.state()->trust, PositionTrust::set) << model << ' ' << terminal;
          EXPECT_NEAR(rig.state()->position, 200 + rig.load_mm(), 0.12);
        });
      }
}

}  // namespace
}  // namespace axisd::test
