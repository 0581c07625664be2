// How much somebody else may take of the log and of the audit: pure, time comes with each call.
#include "buses/ration.hpp"

#include <gmock/gmock.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using LeftOut = Ration::LeftOut;

constexpr TimePoint start{1h};

class Rationed : public ::testing::Test {
 protected:
  /// How many of so many are not left out.
  int taken(const std::string& origin, int count, TimePoint now = start) {
    int result = 0;
    for (int i = 0; i < count; ++i) {
      const auto told = ration_.take(origin, now);
      result += told ? 1 : 0;
      said_ += told.value_or(0);
    }
    return result;
  }
  Ration ration_{{.most = 3, .period = 10s, .origins = 4}};
  std::uint64_t said_ = 0;  ///< with what was taken
};

TEST_F(Rationed, FewAreTakenAndNothingIsSaidOfThem) {
  EXPECT_EQ(ration_.next_due(), TimePoint::max());
  EXPECT_EQ(taken("a", 3), 3);
  EXPECT_EQ(ration_.next_due(), start + 10s);
  EXPECT_THAT(ration_.take_left_out(start + 10s), IsEmpty());
  EXPECT_EQ(ration_.next_due(), TimePoint::max());
}

TEST_F(Rationed, TheRestIsCountedAndSaidOnceThePeriodIsOver) {
  EXPECT_EQ(taken("a", 15), 3);
  EXPECT_THAT(ration_.take_left_out(start + 9999ms), IsEmpty());
  EXPECT_EQ(ration_.next_due(), start + 10s);
  EXPECT_THAT(ration_.take_left_out(start + 10s), ElementsAre(LeftOut{"a", 12}));
  EXPECT_THAT(ration_.take_left_out(start + 10s), IsEmpty()) << "once";
}

TEST_F(Rationed, APeriodBeginsWithTheFirstOneAndEachHasItsOwnNumber) {
  EXPECT_EQ(taken("a", 5), 3);
  EXPECT_EQ(taken("a", 1, start + 9s), 0);
  EXPECT_EQ(said_, 0U);
  EXPECT_EQ(taken("a", 4, start + 10s), 3) << "nobody has asked meanwhile";
  EXPECT_EQ(said_, 3U) << "with the first of them";
  EXPECT_THAT(ration_.take_left_out(start + 10s), IsEmpty());
  EXPECT_THAT(ration_.take_left_out(start + 20s), ElementsAre(LeftOut{"a", 1}));
}

TEST_F(Rationed, OneOriginTakesNothingFromAnother) {
  EXPECT_EQ(taken("a", 1000), 3);
  EXPECT_EQ(taken("b", 3, start + 1s), 3);
  EXPECT_THAT(ration_.take_left_out(start + 11s), ElementsAre(LeftOut{"a", 997}));
}

TEST_F(Rationed, ManyOriginsTakeNoMoreMemoryThanFew) {
  int count = 0;
  for (int i = 0; i < 1000; ++i) count += taken(std::to_string(i), 1);
  EXPECT_EQ(count, 4 + 3) << "those beyond share one";
  EXPECT_THAT(ration_.take_left_out(start + 10s), ElementsAre(LeftOut{"others", 993}));
  EXPECT_EQ(taken("a", 1, start + 11s), 1) << "there is room again";
}

TEST_F(Rationed, WhoIsSilentForAPeriodMakesRoomForOthersButNotWhatWasLeftOut) {
  EXPECT_EQ(taken("loud", 5), 3);
  for (const auto* each : {"a", "b", "c"}) EXPECT_EQ(taken(each, 1), 1);
  for (const auto* each : {"d", "e", "f"}) EXPECT_EQ(taken(each, 2, start + 10s), 2);
  EXPECT_EQ(said_, 0U);
  EXPECT_EQ(taken("loud", 1, start + 10s), 1);
  EXPECT_EQ(said_, 2U);
}

TEST_F(Rationed, NothingIsEverLost) {
  int count = 0;
  constexpr int all = 10'000;
  for (int i = 0; i < all; ++i) {
    const auto now = start + i * 7ms;
    count += taken(i % 3 == 0 ? "a" : "b", 1, now);
    if (i % 1000 == 0)
      for (const auto& each : ration_.take_left_out(now)) said_ += each.count;
  }
  for (const auto& each : ration_.take_left_out(start + 1h)) said_ += each.count;
  EXPECT_EQ(said_ + static_cast<std::uint64_t>(count), static_cast<std::uint64_t>(all));
}

}  // namespace
}  // namespace axisd
