#include "api/axisctl/table.hpp"

#include <gmock/gmock.h>

#include <algorithm>

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

TEST(Table, FoldsToTheTerminalAndLosesNothing) {
  Table table({"AXIS", "STATE", "NODE", "REMARKS"}, {2});
  table.add({"feeder", {"ErrorStop", Colour::red}, "1", "the drive stopped 2 mm before the target"});
  table.add({"dial", "Standstill", "12", ""});
  EXPECT_THAT(table.lines(false, 50, TooWide::fold),
              ElementsAre("AXIS    STATE       NODE  REMARKS",                 //
                          "feeder  ErrorStop      1  the drive stopped 2 mm",  //
                          "                          before the target",       //
                          "dial    Standstill    12"));
  EXPECT_THAT(table.lines(false, 24, TooWide::fold),
              ElementsAre("AXIS    STATE       NODE",  //
                          "    REMARKS",               //
                          "feeder  ErrorStop      1",  //
                          "    the drive stopped 2",   //
                          "    mm before the target",  //
                          "dial    Standstill    12"));
  for (int columns = 1; columns < 80; ++columns)
    for (const auto& line : table.lines(false, columns, TooWide::fold))
      EXPECT_LE(width(line), std::max<std::size_t>(5, static_cast<std::size_t>(columns))) << line;
  EXPECT_EQ(table.lines(false, 0, TooWide::fold), table.lines(false));
}

TEST(Table, LeavesOutColumnsBeforeItFolds) {
  Table table({"AXIS", "BUS", "NODE", "REMARKS"}, {2});
  table.leave_out_first({2, 1});
  table.add({"feeder", "line-a", "1", "simulated"});
  EXPECT_THAT(table.lines(false, 31, TooWide::fold),
              ElementsAre("AXIS    BUS     NODE  REMARKS", "feeder  line-a     1  simulated"));
  EXPECT_THAT(table.lines(false, 30), ElementsAre("AXIS    BUS     REMARKS", "feeder  line-a  simulated"));
  EXPECT_THAT(table.lines(false, 20, TooWide::fold), ElementsAre("AXIS    REMARKS", "feeder  simulated"));
}

}  // namespace
}  // namespace axisd::axisctl
