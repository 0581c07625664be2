#include "api/axisctl/advice.hpp"

#include <gtest/gtest.h>

namespace axisd::axisctl {
namespace {

TEST(Advice, NamesCommandsAndOptionsInPlaceOfCalls) {
  EXPECT_EQ(in_own_words("list them: axisctl list, or ListAxes"), "list them: axisctl list");
  EXPECT_EQ(in_own_words("CellService.ListMachines tells which there are"),
            "axisctl machines tells which there are");
  EXPECT_EQ(in_own_words("use DriveService.WriteParameters for parameters, AxisService to move or stop"),
            "use axisctl drive write for parameters, the commands of axes to move or stop");
  EXPECT_EQ(in_own_words("leave out the metadata axisd-user and axisd-role, or name web"),
            "leave out --as, or name web");
  EXPECT_EQ(in_own_words("options.not_after passed 0.100 s before the request arrived"),
            "what --valid-for gives was over 0.100 s before the request arrived");
  EXPECT_EQ(in_own_words("look at the machine"), "look at the machine");
}

TEST(Advice, OfAnAxisOfOneMachineStaysAsItIs) {
  EXPECT_EQ(advice("then reset: axisctl reset feeder", "feeder"), "then reset: axisctl reset feeder");
}

TEST(Advice, ThroughAnEntranceNamesTheMachine) {
  EXPECT_EQ(advice("look at it; axisctl reset feeder", "press-2/feeder"),
            "look at it; axisctl reset press-2/feeder");
  EXPECT_EQ(advice("ask its holder, or: axisctl lease acquire feeder --take", "press-2/feeder"),
            "ask its holder, or: axisctl lease acquire press-2/feeder --take");
  EXPECT_EQ(advice("accept it: axisctl state, axisctl state accept", "press-2/feeder"),
            "accept it: axisctl --machine press-2 state, axisctl --machine press-2 state accept");
  EXPECT_EQ(advice("release it: axisctl release-stop --all", "press-2/feeder"),
            "release it: axisctl --machine press-2 release-stop --all");
  EXPECT_EQ(advice("axisctl home home", "press-2/home"), "axisctl home press-2/home");
  EXPECT_EQ(advice("axisctl reset feeder-2", "press-2/feeder"), "axisctl --machine press-2 reset feeder-2");
  EXPECT_EQ(advice("CellService.ListMachines tells which there are", "press-9/feeder"),
            "axisctl machines tells which there are");
}

}  // namespace
}  // namespace axisd::axisctl
