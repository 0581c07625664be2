// How much of the log somebody else may fill: pure, time comes with each call.
#include "buses/line_limit.hpp"

#include <gmock/gmock.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using LeftOut = LineLimit::LeftOut;

constexpr TimePoint start{1h};

class Lines : public ::testing::Test {
 protected:
  /// How many of so many lines are written.
  int written(const std::string& origin, int lines, TimePoint now = start) {
    int count = 0;
    for (int i = 0; i < lines; ++i) count += limit_.admit(origin, now) ? 1 : 0;
    return count;
  }
  LineLimit limit_{{.most = 3, .period = 10s, .origins = 4}};
};

TEST_F(Lines, FewAreWrittenAndNothingIsSaidOfThem) {
  EXPECT_EQ(limit_.next_due(), TimePoint::max());
  EXPECT_EQ(written("a", 3), 3);
  EXPECT_EQ(limit_.next_due(), start + 10s);
  EXPECT_THAT(limit_.take_left_out(start + 10s), IsEmpty());
  EXPECT_EQ(limit_.next_due(), TimePoint::max());
}

TEST_F(Lines, TheRestIsCountedAndSaidOnceThePeriodIsOver) {
  EXPECT_EQ(written("a", 15), 3);
  EXPECT_THAT(limit_.take_left_out(start + 9999ms), IsEmpty());
  EXPECT_EQ(limit_.next_due(), start + 10s);
  EXPECT_THAT(limit_.take_left_out(start + 10s), ElementsAre(LeftOut{"a", 12}));
  EXPECT_THAT(limit_.take_left_out(start + 10s), IsEmpty()) << "once";
}

TEST_F(Lines, APeriodBeginsWithTheFirstLineAndEachHasItsOwnNumber) {
  EXPECT_EQ(written("a", 5), 3);
  EXPECT_EQ(written("a", 1, start + 9s), 0);
  EXPECT_EQ(written("a", 4, start + 10s), 3) << "nobody has asked meanwhile";
  EXPECT_LE(limit_.next_due(), start + 10s) << "there is something to be said";
  EXPECT_THAT(limit_.take_left_out(start + 10s), ElementsAre(LeftOut{"a", 3}));
  EXPECT_THAT(limit_.take_left_out(start + 20s), ElementsAre(LeftOut{"a", 1}));
}

TEST_F(Lines, OneOriginTakesNothingFromAnother) {
  EXPECT_EQ(written("a", 1000), 3);
  EXPECT_EQ(written("b", 3, start + 1s), 3);
  EXPECT_THAT(limit_.take_left_out(start + 11s), ElementsAre(LeftOut{"a", 997}));
}

TEST_F(Lines, ManyOriginsTakeNoMoreMemoryOrLines) {
  int count = 0;
  for (int i = 0; i < 1000; ++i) count += written(std::to_string(i), 1);
  EXPECT_EQ(count, 4 + 3);
  EXPECT_THAT(limit_.take_left_out(start + 10s), ElementsAre(LeftOut{"others", 993}));
  EXPECT_EQ(written("a", 1, start + 11s), 1) << "there is room again";
}

TEST_F(Lines, NothingIsEverLost) {
  std::uint64_t said = 0;
  int count = 0;
  constexpr int lines = 10'000;
  for (int i = 0; i < lines; ++i) {
    const auto now = start + i * 7ms;
    count += written(i % 3 == 0 ? "a" : "b", 1, now);
    if (i % 1000 == 0)
      for (const auto& each : limit_.take_left_out(now)) said += each.lines;
  }
  for (const auto& each : limit_.take_left_out(start + 1h)) said += each.lines;
  EXPECT_EQ(said + static_cast<std::uint64_t>(count), static_cast<std::uint64_t>(lines));
}

}  // namespace
}  // namespace axisd
