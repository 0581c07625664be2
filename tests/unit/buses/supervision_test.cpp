#include "buses/supervision.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "buses/heartbeat.hpp"

namespace axisd {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Sign = Supervision::Sign;

constexpr Duration interval = seconds(1);

class Watched : public ::testing::Test {
 protected:
  /// Looks each period until `part` is found dead. How long after its last stamp that was.
  [[nodiscard]] Duration told_after(Duration first_look_after) const {
    Supervision supervision(interval);
    const std::vector<Supervision::Part> parts{{.name = "core", .last = start_}};
    for (auto now = start_ + first_look_after; now < start_ + seconds(10);) {
      const auto finding = supervision.look(now, parts, true);
      if (finding.sign == Sign::dead) return now - start_;
      EXPECT_EQ(finding.sign, Sign::alive);
      now += finding.next;
    }
    return seconds(10);
  }
  [[nodiscard]] std::vector<Supervision::Part> alive(TimePoint now) const {
    return {{.name = "core", .last = now - heartbeat}, {.name = "line-a", .last = now}};
  }

  const TimePoint start_ = TimePoint(seconds(1000));
  Supervision supervision_{interval};
};

TEST_F(Watched, AThreadThatStandsStillIsToldWithinOneInterval) {
  for (const auto first : {milliseconds(0), milliseconds(1), milliseconds(125), milliseconds(249)})
    EXPECT_LE(told_after(first), interval) << first.count();
}

TEST_F(Watched, ALoopThatIsWokenLateIsAlive) {
  const auto late = start_ - 3 * heartbeat;
  EXPECT_EQ(supervision_.look(start_, {{.name = "core", .last = late}}, true).sign, Sign::alive);
}

TEST_F(Watched, NamesAllThatStandStill) {
  const auto dead = start_ - interval;
  const auto finding = supervision_.look(start_,
                                         {{.name = "core", .last = dead},
                                          {.name = "stop lane", .last = start_},
                                          {.name = "line-a", .last = dead}},
                                         true);
  EXPECT_EQ(finding.sign, Sign::dead);
  EXPECT_THAT(finding.dead, ElementsAre("core", "line-a"));
}

TEST_F(Watched, WhoIsBusyUntilLaterIsAlive) {
  EXPECT_EQ(supervision_.look(start_, {{.name = "line-a", .last = start_ + seconds(2)}}, true).sign,
            Sign::alive);
}

TEST_F(Watched, ClientsWithoutAnAnswerAreToldByNothing) {
  const auto finding = supervision_.look(start_, alive(start_), false);
  EXPECT_EQ(finding.sign, Sign::silent);
  EXPECT_THAT(finding.dead, IsEmpty());
}

TEST_F(Watched, AfterAPauseOfAllThatIsLookedAtAgainBeforeAnybodyIsTakenForDead) {
  (void)supervision_.look(start_, alive(start_), true);
  const auto parts = alive(start_);
  const auto now = start_ + milliseconds(900);  // the process was held up, and goes on
  const auto unsure = supervision_.look(now, parts, true);
  EXPECT_EQ(unsure.sign, Sign::unsure);
  EXPECT_LT(unsure.next, interval - milliseconds(900));
  const auto again = now + unsure.next;
  EXPECT_EQ(supervision_.look(again, parts, true).sign, Sign::dead) << "they did not go on";
}

TEST_F(Watched, APauseOfAllAfterWhichTheyGoOnIsNone) {
  (void)supervision_.look(start_, alive(start_), true);
  const auto now = start_ + milliseconds(900);
  EXPECT_EQ(supervision_.look(now, alive(now), true).sign, Sign::alive);
}

TEST(Unwatched, IsLookedAtSeldomAndWithPatience) {
  Supervision supervision{Duration::zero()};
  EXPECT_EQ(supervision.period(), seconds(1));
  const TimePoint now(seconds(1000));
  EXPECT_EQ(supervision.look(now, {{.name = "core", .last = now - seconds(2)}}, true).sign, Sign::alive);
  EXPECT_EQ(supervision.look(now, {{.name = "core", .last = now - seconds(4)}}, true).sign, Sign::dead);
}

}  // namespace
}  // namespace axisd
