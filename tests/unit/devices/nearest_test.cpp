#include "devices/nearest.hpp"

#include <gmock/gmock.h>

namespace axisd {
namespace {

using testing::HasSubstr;

const std::vector<std::string> axes{"feeder", "turntable", "lift-a"};

TEST(Nearest, IsWhatWasProbablyMeant) {
  EXPECT_EQ(did_you_mean("feedr", axes, "look"), "did you mean 'feeder'?");
  EXPECT_EQ(did_you_mean("FEEDER", axes, "look"), "did you mean 'feeder'?");
  EXPECT_EQ(did_you_mean("turntabel", axes, "look"), "did you mean 'turntable'?");
  EXPECT_EQ(did_you_mean("stpo", {"halt", "stop", "show"}, "look"), "did you mean 'stop'?");
  EXPECT_EQ(did_you_mean("gripper", axes, "look"), "look");
  EXPECT_EQ(did_you_mean("feeder", {}, "look"), "look");
}

TEST(Nearest, OfSeveralItIsTheNearest) {
  EXPECT_EQ(did_you_mean("axis-1", {"axis-22", "axis-2", "axis-11"}, "look"), "did you mean 'axis-2'?");
  EXPECT_EQ(did_you_mean("axis-11x", {"axis-22", "axis-2", "axis-11"}, "look"), "did you mean 'axis-11'?");
  EXPECT_EQ(did_you_mean("ba", {"ab"}, "look"), "did you mean 'ab'?");
  EXPECT_EQ(did_you_mean("a", {"ab", ""}, "look"), "did you mean 'ab'?");
  EXPECT_EQ(did_you_mean("xyfeeder", {"feeder"}, "look"), "did you mean 'feeder'?");
  EXPECT_EQ(did_you_mean("", {"abc"}, "look"), "look");
  const std::string longest(60, 'a');
  EXPECT_EQ(did_you_mean(longest, {longest + std::string(20, 'b')}, "look").substr(0, 12), "did you mean");
  EXPECT_EQ(did_you_mean(longest, {longest + std::string(21, 'b'), std::string(500, 'a')}, "look"), "look");
}

TEST(Nearest, AnErrorSaysWhereTheNamesAre) {
  const auto typo = no_such_axis("feedr", axes);
  EXPECT_EQ(typo.reason, Reason::unknown_axis);
  EXPECT_EQ(to_string(typo), "there is no axis 'feedr'; did you mean 'feeder'?");
  EXPECT_THAT(to_string(no_such_axis("gripper", axes)), HasSubstr("axisctl list"));
  EXPECT_THAT(to_string(no_such_group("cell", {"transfer"}, axes)),
              HasSubstr("there is no group 'cell'; list them"));
  EXPECT_EQ(no_such_group("transfr", {"transfer"}, axes).remedy, "did you mean 'transfer'?");
  EXPECT_EQ(no_such_group("feeder", {"transfer"}, axes).remedy, "it is an axis: name it as one");
}

TEST(Nearest, NamesOfStrangersCannotForgeLines) {
  EXPECT_EQ(no_such_axis("a\n\x1b[31mb", axes).message, "there is no axis 'a??[31mb'");
  EXPECT_LT(no_such_axis(std::string(100'000, 'x'), axes).message.size(), 100U);
}

}  // namespace
}  // namespace axisd
