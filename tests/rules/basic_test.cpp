#include <gtest/gtest.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

TEST(Basic, EnablesMovesAndStops) {
  Rig rig;
  rig.ready();
  EXPECT_EQ(rig.state()->state, AxisState::standstill);
  const auto moved = rig.complete(MoveAbsoluteRequest{.position = 120, .with = {.velocity = 50}});
  EXPECT_EQ(moved.state, CommandState::done) << (moved.cause ? to_string(*moved.cause) : "");
  EXPECT_DOUBLE_EQ(rig.load_mm(), 120);
  EXPECT_EQ(rig.drive->starts(), 1);
  EXPECT_DOUBLE_EQ(rig.state()->position, 120);

  const auto move = rig.submit(MoveAbsoluteRequest{.position = 0, .with = {.velocity = 50}});
  EXPECT_EQ(rig.state()->state, AxisState::discrete_motion);
  rig.run(500ms);
  const auto stop = rig.submit(StopRequest{});
  EXPECT_EQ(rig.state()->state, AxisState::stopping);
  EXPECT_EQ(move->value().state, CommandState::aborted);
  rig.run_until([&] { return stop->has_ended(); }, 5s);
  EXPECT_EQ(stop->value().state, CommandState::done);
  EXPECT_EQ(rig.state()->state, AxisState::standstill);
  EXPECT_FALSE(rig.drive->shaft_moving());
}

TEST(Basic, Homes) {
  for (const bool invert : {false, true}) {
    SCOPED_TRACE(invert);
    Rig rig({.invert = invert});
    rig.enable();
    const auto home = rig.complete(HomeRequest{});
    EXPECT_EQ(home.state, CommandState::done) << (home.cause ? to_string(*home.cause) : "");
    EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
    EXPECT_NEAR(rig.load_mm(), -50, 0.5);
    EXPECT_NEAR(rig.state()->position, 0, 0.011);
  }
}

}  // namespace
}  // namespace axisd::test
