// M21 on a CiA 402 drive without 60FDh: its switches are its own affair.
#include <gtest/gtest.h>

#include "tests/rules/model_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

TEST(M21, ADriveThatShowsNoInputsHomesByItself) {
  ModelRig rig({.model = "cia402", .shows_inputs = false});
  EXPECT_FALSE(rig.has_terminal("home"));
  EXPECT_EQ(rig.complete(EnableRequest{}).state, CommandState::done);
  for (const auto* from : {"from afar", "where it stands on the switch"}) {
    const auto home = rig.complete(HomeRequest{});
    EXPECT_EQ(home.state, CommandState::done) << from << ": " << describe(home);
    EXPECT_EQ(rig.state()->trust, PositionTrust::homed) << from;
    // It passes the switch by what it needs to brake.
    EXPECT_NEAR(rig.load_mm(), ModelRig::home_edge, 3) << from;
    EXPECT_NEAR(rig.state()->position, 3, 3) << from;
  }
}

}  // namespace
}  // namespace axisd::test
