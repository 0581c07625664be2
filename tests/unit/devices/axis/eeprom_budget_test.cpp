#include "devices/axis/eeprom_budget.hpp"

#include <gmock/gmock.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

// 2023-11-14 22:00 UTC, a full hour.
const WallTime start{1'699'999'200s};
constexpr std::uint64_t bound = 10;

/// Counts until the bound; how often that went.
std::uint64_t fill(EepromBudget& budget, WallTime now) {
  std::uint64_t saves = 0;
  for (; budget.permit(1, now) && saves < 1000; ++saves) budget.count(1, now);
  return saves;
}

TEST(EepromBudget, PermitsSoManyADay) {
  EepromBudget budget(bound, {});
  EXPECT_EQ(fill(budget, start + 30min), bound);
  EXPECT_FALSE(budget.permit(1, start + 24h + 30min)) << "the hour that it was saved in counts whole";
  EXPECT_TRUE(budget.permit(1, start + 25h));
  EXPECT_EQ(fill(budget, start + 25h), bound);
  EXPECT_EQ(budget.record().saves, 2 * bound) << "nothing of that is forgotten";
}

TEST(EepromBudget, AnySpanOfADayHoldsNoMoreThanTheBound) {
  EepromBudget budget(bound, {});
  std::vector<WallTime> saved;
  for (auto now = start; now < start + 200h; now += 7min) {
    if (!budget.permit(1, now)) continue;
    budget.count(1, now);
    saved.push_back(now);
  }
  ASSERT_GT(saved.size(), 5 * bound);
  for (std::size_t i = bound; i < saved.size(); ++i) EXPECT_GE(saved[i] - saved[i - bound], 24h) << i;
}

TEST(EepromBudget, SeveralAreAllPermittedOrNone) {
  EepromBudget budget(bound, {});
  budget.count(bound - 2, start);
  EXPECT_TRUE(budget.permit(2, start));
  EXPECT_FALSE(budget.permit(3, start));
  EXPECT_TRUE(budget.permit(bound, start + 25h));
}

TEST(EepromBudget, ARefusalTellsTheFigures) {
  EepromBudget budget(bound, {.saves = 990});
  budget.count(4, start + 10min);
  budget.count(6, start + 3h);
  const auto one = budget.permit(1, start + 5h);
  ASSERT_FALSE(one);
  EXPECT_EQ(one.error().reason, Reason::eeprom_budget);
  EXPECT_EQ(one.error().outcome, Outcome::not_sent);
  EXPECT_THAT(one.error().message, HasSubstr("10 times in the last 24 h"));
  EXPECT_THAT(one.error().message, HasSubstr("permits 10"));
  EXPECT_THAT(one.error().message, HasSubstr("1000 times in all, of about 100000"));
  EXPECT_THAT(one.error().remedy, HasSubstr("from 2023-11-15 23:00 UTC"));
  EXPECT_THAT(budget.permit(5, start + 5h).error().remedy, HasSubstr("from 2023-11-16 02:00 UTC"));
  EXPECT_THAT(budget.permit(bound + 1, start + 5h).error().remedy,
              HasSubstr("it takes 11 saves: raise limits.eeprom_saves_per_day"));
  EXPECT_TRUE(budget.permit(1, start + 25h)) << "as it said";
}

TEST(EepromBudget, GoesOnFromWhatWasKept) {
  EepromBudget before(bound, {});
  fill(before, start);
  EepromBudget after(bound, before.record());
  EXPECT_FALSE(after.permit(1, start + 20h));
  EXPECT_TRUE(after.permit(1, start + 25h));
  EepromBudget raised(bound + 1, before.record());
  EXPECT_TRUE(raised.permit(1, start));
}

TEST(EepromBudget, KeepsADayAtMost) {
  EepromBudget budget(1'000'000, {});
  for (auto now = start; now < start + 1000h; now += 13min) budget.count(1, now);
  EXPECT_LE(budget.record().by_hour.size(), 25U);
}

TEST(EepromBudget, AClockThatIsSetBackNeitherUnlocksNorLocksForEver) {
  for (const auto back : {1s + 0h, 1h + 0s, 23h + 0s, 24h * 400 + 0s}) {
    EepromBudget budget(bound, {});
    fill(budget, start);
    const auto now = start - back;
    EXPECT_FALSE(budget.permit(1, now)) << back.count();
    EXPECT_FALSE(budget.permit(1, now + 23h)) << back.count();
    EXPECT_TRUE(budget.permit(1, now + 25h)) << back.count();
    // Looked at only after a while, and in the past still: from then on.
    EepromBudget unseen(bound, {});
    fill(unseen, start + 24h * 1000);
    EXPECT_FALSE(unseen.permit(1, start + 24h * 500));
    EXPECT_TRUE(unseen.permit(1, start + 24h * 500 + 25h));
  }
}

TEST(EepromBudget, AClockThatGoesBackAndForthUnlocksNothing) {
  EepromBudget budget(bound, {});
  fill(budget, start);
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(budget.permit(1, start + (i % 2 == 0 ? -5h : 5h))) << i;
}

TEST(EepromBudget, WhatLiesAheadIsPutIntoThisHourOnce) {
  EepromBudget budget(bound, {.saves = 3, .by_hour = {{500'000, 3}}});
  EXPECT_TRUE(budget.settle(start)) << "to be kept";
  EXPECT_EQ(budget.record().by_hour, (std::map<std::int64_t, std::uint64_t>{{1'699'999'200 / 3600, 3}}));
  EXPECT_FALSE(budget.settle(start));
}

}  // namespace
}  // namespace axisd
