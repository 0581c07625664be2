// When memory is given back.
#include "api/transport/trim_plan.hpp"

#include <gtest/gtest.h>

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using transport::TrimPlan;

constexpr std::size_t mib = std::size_t{1024} * 1024;

class TrimPlanTest : public ::testing::Test {
 protected:
  /// How often it is tried in that time, if each time leaves that much.
  int tries(std::size_t resident, std::size_t left, Duration time) {
    int number = 0;
    for (const auto end = now_ + time; now_ < end; now_ += 200ms)
      if (plan_.due(now_, resident)) {
        ++number;
        plan_.trimmed(left);
        resident = left > 0 ? left : resident;
      }
    return number;
  }
  TimePoint now_ = TimePoint{} + 1h;
  TrimPlan plan_{40 * mib};
};

TEST_F(TrimPlanTest, NothingIsTriedWhereNothingHasGrown) { EXPECT_EQ(tries(55 * mib, 55 * mib, 1h), 0); }

TEST_F(TrimPlanTest, WhatHasGrownIsTriedAFewTimesAndNoMore) {
  EXPECT_EQ(tries(56 * mib, 56 * mib, 900ms), 1);
  EXPECT_EQ(tries(56 * mib, 56 * mib, 1s), 1);
  EXPECT_EQ(tries(56 * mib, 56 * mib, 1h), TrimPlan::tries - 2);
  EXPECT_EQ(tries(71 * mib, 71 * mib, 1h), 0) << "from what was left";
  EXPECT_EQ(tries(72 * mib, 72 * mib, 1h), TrimPlan::tries);
}

TEST_F(TrimPlanTest, WhatIsBackAtTheStartIsTriedNoMore) { EXPECT_EQ(tries(100 * mib, 50 * mib, 1h), 1); }

TEST_F(TrimPlanTest, WhatGrowsAgainMeanwhileHasAllItsTries) {
  EXPECT_EQ(tries(100 * mib, 90 * mib, 10s), 4);
  EXPECT_EQ(tries(106 * mib, 90 * mib, 1h), TrimPlan::tries);
}

TEST_F(TrimPlanTest, WhoLeavesMakesItDueOnceGrpcHasLetGo) {
  EXPECT_EQ(tries(100 * mib, 100 * mib, 1h), TrimPlan::tries);
  plan_.let_go(now_);
  EXPECT_FALSE(plan_.due(now_ + TrimPlan::settled_after - 1ms, 100 * mib));
  EXPECT_TRUE(plan_.due(now_ + TrimPlan::settled_after, 100 * mib));
  EXPECT_EQ(tries(100 * mib, 100 * mib, 1h), TrimPlan::tries - 1);
}

TEST_F(TrimPlanTest, WhoLeavesWithoutHavingTakenMuchMakesNothingDue) {
  plan_.let_go(now_);
  EXPECT_EQ(tries(55 * mib, 55 * mib, 1h), 0);
}

TEST_F(TrimPlanTest, WhatTheSystemDoesNotSayIsNoMemory) {
  plan_.let_go(now_);
  EXPECT_EQ(tries(0, 0, 1h), 0);
  EXPECT_EQ(tries(100 * mib, 0, 1h), TrimPlan::tries);
  EXPECT_EQ(tries(100 * mib, 100 * mib, 1h), 0) << "it is taken for as much as before";
}

}  // namespace
}  // namespace axisd::testing
