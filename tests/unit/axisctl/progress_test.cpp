#include "api/axisctl/progress.hpp"

#include <gtest/gtest.h>

namespace axisd::axisctl {
namespace {

v1::Command absolute(double position) {
  v1::Command command;
  command.set_kind(v1::COMMAND_KIND_MOVE_ABSOLUTE);
  command.mutable_asked()->set_position(position);
  return command;
}

TEST(Progress, PercentOfTheWayInBothDirections) {
  EXPECT_EQ(percent_of_way(0, 200, 50), 25);
  EXPECT_EQ(percent_of_way(200, 0, 50), 75);
  EXPECT_EQ(percent_of_way(0, 100, 101), 100);
  EXPECT_EQ(percent_of_way(0, 100, -1), 0);
  EXPECT_EQ(percent_of_way(5, 5, 5), std::nullopt);
  EXPECT_EQ(percent_of_way(0, std::nullopt, 5), std::nullopt);
}

TEST(Progress, TargetIsTheGrantedOne) {
  auto command = absolute(100);
  EXPECT_EQ(target_of(command, 0), 100);
  command.mutable_granted()->set_position(100.01);
  EXPECT_EQ(target_of(command, 0), 100.01);
  v1::Command relative;
  relative.set_kind(v1::COMMAND_KIND_MOVE_RELATIVE);
  relative.mutable_asked()->set_distance(-10);
  EXPECT_EQ(target_of(relative, 50), 40);
  EXPECT_EQ(target_of(relative, std::nullopt), std::nullopt);
  v1::Command endless;
  endless.set_kind(v1::COMMAND_KIND_MOVE_VELOCITY);
  EXPECT_EQ(target_of(endless, 50), std::nullopt);
}

TEST(Progress, LineTellsPositionVelocityWayAndTime) {
  v1::AxisState state;
  state.set_axis("feeder");
  state.set_unit("mm");
  state.set_position(50);
  state.set_velocity(20);
  state.set_state(v1::STATE_DISCRETE_MOTION);
  state.mutable_measured_at()->set_seconds(101);
  state.mutable_age()->set_nanos(300'000'000);
  auto command = absolute(100);
  command.mutable_accepted_at()->set_seconds(100);
  EXPECT_EQ(progress_text(state, command, 0), "feeder  50 mm  20 mm/s  [##########          ]  50 %  1.3 s");
  EXPECT_EQ(progress_text(state, v1::Command(), 0), "feeder  50 mm  20 mm/s  DiscreteMotion");
}

TEST(Progress, OnlyDoneIsSuccess) {
  v1::Command command;
  for (const auto& [state, code] :
       {std::pair(v1::COMMAND_STATE_ACTIVE, ExitCode::ok), std::pair(v1::COMMAND_STATE_DONE, ExitCode::ok),
        std::pair(v1::COMMAND_STATE_ABORTED, ExitCode::ended_otherwise),
        std::pair(v1::COMMAND_STATE_ERROR, ExitCode::ended_otherwise),
        std::pair(v1::COMMAND_STATE_UNKNOWN, ExitCode::ended_otherwise)}) {
    command.set_state(state);
    EXPECT_EQ(outcome(command), code) << state;
  }
}

}  // namespace
}  // namespace axisd::axisctl
