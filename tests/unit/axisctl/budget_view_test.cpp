#include "api/axisctl/budget_view.hpp"

#include <gmock/gmock.h>
#include <google/protobuf/util/time_util.h>

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>

namespace axisd::axisctl {
namespace {

using google::protobuf::util::TimeUtil;
using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

/// Axes a1, a2, ...; the last frame of a stop of k of them comes after 10 k ms, the standstill after 100 k
/// ms.
v1::BusBudget line_with(int axes) {
  v1::BusBudget budget;
  budget.set_bus("line-a");
  for (int moving = 0; moving <= axes; ++moving)
    budget.add_load()->set_moving(static_cast<std::uint32_t>(moving));
  for (int count = 1; count <= axes; ++count) {
    auto& stop = *budget.add_stops();
    stop.set_axes(static_cast<std::uint32_t>(count));
    *stop.mutable_last_frame() = TimeUtil::MillisecondsToDuration(std::int64_t{10} * count);
    *stop.mutable_standstill() = TimeUtil::MillisecondsToDuration(std::int64_t{100} * count);
    budget.add_axes()->set_axis("a" + std::to_string(count));
  }
  return budget;
}

TEST(BudgetView, SaysWhereRowsAreLeftOut) {
  const auto note = "MOVING, STOPPED: not all numbers of axes are shown; --json has them\n";
  EXPECT_THAT(budget_text(line_with(3), {}, false), AllOf(HasSubstr("3     30.0 ms"), Not(HasSubstr(note))));
  EXPECT_THAT(budget_text(line_with(4), {}, false),
              AllOf(Not(HasSubstr("3     30.0 ms")),
                    HasSubstr("\n      4     40.0 ms    400.0 ms\n" + std::string(note))));
  EXPECT_THAT(budget_text(line_with(0), {}, false), Not(HasSubstr(note)));
}

TEST(BudgetView, SaysHowLongTheLastOfSeveralStartsWaits) {
  auto budget = line_with(2);
  *budget.mutable_load(2)->mutable_start() = TimeUtil::MillisecondsToDuration(80);
  EXPECT_THAT(budget_text(budget, {}, false),
              AllOf(ContainsRegex("MOVING .* START\n"), ContainsRegex("\n +2 .* 80.0 ms\n")));
}

TEST(BudgetView, GroupsHaveWhatTheirAxesOnTheBusHave) {
  v1::ListGroupsResponse groups;
  const auto add = [&](const char* name, std::initializer_list<const char*> axes) {
    auto& group = *groups.add_groups();
    group.set_name(name);
    for (const auto* axis : axes) group.add_axes(axis);
  };
  add("gantry", {"a1", "elsewhere", "a4", "a5"});
  add("others", {"elsewhere", "nowhere"});
  const auto text = budget_text(line_with(5), groups, false);
  EXPECT_THAT(text,
              HasSubstr("\nGROUP   AXES  LAST FRAME  STANDSTILL\ngantry     3     30.0 ms    300.0 ms\n\n"));
  EXPECT_THAT(text, Not(HasSubstr("others")));
  EXPECT_THAT(budget_text(line_with(5), {}, false), Not(HasSubstr("GROUP")));
}

TEST(BudgetView, SaysWhyAStopOfFewerAxesMayTakeLonger) {
  auto budget = line_with(3);
  EXPECT_THAT(budget_text(budget, {}, false), Not(HasSubstr("STANDSTILL: ")));
  *budget.mutable_stops(0)->mutable_standstill() = TimeUtil::MillisecondsToDuration(882);
  EXPECT_THAT(budget_text(budget, {}, false), HasSubstr("STANDSTILL: of fewer axes it may come later"));
}

TEST(BudgetView, NoBoundIsNoWay) {
  auto budget = line_with(1);
  auto& axis = *budget.mutable_axes(0);
  axis.set_unit("mm");
  axis.set_way_alone(std::numeric_limits<double>::infinity());
  axis.set_way_all(12.5);
  *axis.mutable_stop_all()->mutable_last_frame() = TimeUtil::MillisecondsToDuration(10);
  EXPECT_THAT(budget_text(budget, {}, false),
              AllOf(ContainsRegex("a1 +alone .* -\n"), HasSubstr(" 12.5 mm\n")));
}

}  // namespace
}  // namespace axisd::axisctl
