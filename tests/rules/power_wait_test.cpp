// A motion that is asked for while its axis is being enabled waits for that, on every bus (M1, M14, M31).
#include <gtest/gtest.h>

#include <string>

#include "tests/rules/model_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

class PowerWait : public ::testing::TestWithParam<std::string> {};

TEST_P(PowerWait, AHomingStartsWhenItsAxisIsEnabled) {
  ModelRig rig({.model = GetParam()});
  const auto enable = rig.try_submit(EnableRequest{});
  ASSERT_TRUE(enable) << to_string(enable.error());
  const auto home = rig.try_submit(HomeRequest{});
  ASSERT_TRUE(home) << to_string(home.error());
  ASSERT_FALSE((*enable)->has_ended());
  EXPECT_EQ((*home)->value().state, CommandState::accepted);
  ASSERT_TRUE(rig.run_until([&] { return (*home)->has_ended(); }, 60s));
  EXPECT_EQ((*enable)->value().state, CommandState::done) << describe((*enable)->value());
  EXPECT_EQ((*home)->value().state, CommandState::done) << describe((*home)->value());
  EXPECT_GE(*(*home)->value().started_at, *(*enable)->value().ended_at);
}

/// A stop ends what waits, too, and nothing of it starts later.
TEST_P(PowerWait, AStopEndsWhatWaits) {
  ModelRig rig({.model = GetParam()});
  ASSERT_TRUE(rig.try_submit(EnableRequest{}));
  const auto home = rig.try_submit(HomeRequest{});
  ASSERT_TRUE(home);
  ASSERT_TRUE(rig.try_submit(StopRequest{.kind = StopKind::stop}));
  rig.run(5s);
  EXPECT_EQ((*home)->value().state, CommandState::aborted) << describe((*home)->value());
  EXPECT_FALSE((*home)->value().started_at);
  EXPECT_NEAR(rig.load_mm(), 0, 0.5);
}

TEST_P(PowerWait, OneMotionWaitsAndNoMore) {
  ModelRig rig({.model = GetParam()});
  ASSERT_TRUE(rig.try_submit(EnableRequest{}));
  ASSERT_TRUE(rig.try_submit(HomeRequest{}));
  const auto second = rig.try_submit(MoveRelativeRequest{.distance = 5});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().reason, Reason::disabled) << to_string(second.error());
}

INSTANTIATE_TEST_SUITE_P(Models, PowerWait, ::testing::ValuesIn(simulated_models()), [](const auto& one) {
  auto name = one.param;
  for (auto& letter : name)
    if (letter == '-') letter = '_';
  return name;
});

/// It waits for no longer than any other start (M31).
TEST(M31, WhatWaitedTooLongForPowerDoesNotStart) {
  Rig rig({.adjust = [](AxisSettings& axis) { axis.brake.release_time = 3s; }, .limits = false});
  const CommandOptions options{.client = "a", .arrived = rig.world.now()};
  const auto enable = rig.submit(EnableRequest{}, options);
  const auto move = rig.submit(MoveRelativeRequest{.distance = 5}, options);
  ASSERT_TRUE(rig.run_until([&] { return enable->has_ended() && move->has_ended(); }, 10s));
  EXPECT_EQ(enable->value().state, CommandState::done) << describe(enable->value());
  EXPECT_EQ(move->value().state, CommandState::aborted) << describe(move->value());
  ASSERT_TRUE(move->value().cause);
  EXPECT_EQ(move->value().cause->reason, Reason::expired) << describe(move->value());
  rig.run(2s);
  EXPECT_EQ(rig.triggers(), 0);
}

}  // namespace
}  // namespace axisd::test
