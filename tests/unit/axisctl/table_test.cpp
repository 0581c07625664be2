#include "api/axisctl/table.hpp"

#include <gmock/gmock.h>

namespace axisd::axisctl {
namespace {

using testing::ElementsAre;

TEST(Table, AlignsNumbersAtTheRightAndLeavesNoTrailingBlanks) {
  Table table({"AXIS", "POSITION", "REMARKS"}, {1});
  table.add({"feeder", "12.5", "simulated"});
  table.add({"turntable", "-120", ""});
  EXPECT_THAT(table.lines(false), ElementsAre("AXIS       POSITION  REMARKS",    //
                                              "feeder         12.5  simulated",  //
                                              "turntable      -120"));
}

TEST(Table, CountsCharactersNotBytes) {
  Table table({"UNIT", "X"});
  table.add({"\u00b5m", "1"});
  EXPECT_EQ(table.lines(false).at(1), "\u00b5m    1");
  EXPECT_EQ(width("\u00b5m"), 2U);
}

TEST(Table, ClipsToTheTerminal) {
  Table table({"AXIS", "STATE"});
  table.add({"feeder", {"Standstill", Colour::green}});
  EXPECT_THAT(table.lines(false, 12), ElementsAre("AXIS    STAT", "feeder  Stan"));
  EXPECT_EQ(table.lines(false, 3).at(1), "fee");
  EXPECT_EQ(table.lines(true, 12).at(1), "feeder  \x1b[32mStan\x1b[0m");
}

}  // namespace
}  // namespace axisd::axisctl
