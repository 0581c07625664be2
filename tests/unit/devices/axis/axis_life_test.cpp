#include "devices/axis/axis_life.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using State = AxisLife::State;

TEST(AxisLife, ItServesUntilTheDaemonEnds) {
  AxisLife life;
  EXPECT_FALSE(life.ends());
  life.close();
  EXPECT_EQ(life.state(), State::closing);
  EXPECT_TRUE(life.ends());
  EXPECT_FALSE(life.retired());
}

TEST(AxisLife, WhatIsRetiredEndsAndKnowsWhetherItsDriveAnswered) {
  for (const bool answers : {true, false}) {
    AxisLife life;
    life.retire(answers);
    EXPECT_TRUE(life.ends());
    EXPECT_TRUE(life.retired());
    EXPECT_EQ(life.answered(), answers);
  }
}

TEST(AxisLife, WhatIsRetiredStaysSoWhenItIsClosed) {
  AxisLife life;
  life.retire(true);
  life.close();
  EXPECT_EQ(life.state(), State::retired_online);
}

}  // namespace
}  // namespace axisd
