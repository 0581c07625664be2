// What the watchdog of an entrance is told.
#include "api/cell/watch.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace axisd::cell {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::IsEmpty;
using ::testing::Not;

/// Time that a test lets pass.
class TestClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  [[nodiscard]] WallTime wall(TimePoint /*t*/) const override { return {}; }
  void pass(Duration time) {
    for (const auto end = now_ + time; now_ < end; run_due(now_)) now_ = std::min(end, next_due());
  }

 private:
  void schedule(TimePoint /*when*/) override {}
  TimePoint now_ = TimePoint{} + 1h;
};

class WatchTest : public ::testing::Test {
 protected:
  void watch(Duration interval = 10s) {
    watch_.emplace(
        clock_, interval,
        [this] {
          return Watch::Progress{.accept_loop = accept_loop_.value_or(clock_.now()),
                                 .hand_over = hand_over_.value_or(clock_.now())};
        },
        [this](const char* state) { told_.emplace_back(state); });
  }
  /// What was told in that time.
  std::vector<std::string> in(Duration time) {
    told_.clear();
    clock_.pass(time);
    return std::exchange(told_, {});
  }

  TestClock clock_;
  std::optional<TimePoint> accept_loop_, hand_over_;  ///< since then it stands still
  std::vector<std::string> told_;
  std::optional<Watch> watch_;
};

TEST_F(WatchTest, WhoComesRoundLives) {
  watch();
  EXPECT_THAT(told_, Contains("WATCHDOG=1")) << "at once";
  EXPECT_THAT(in(10s), AllOf(Each("WATCHDOG=1"), ::testing::SizeIs(::testing::Ge(4))));
}

TEST_F(WatchTest, AnAcceptLoopThatStandsStillIsDead) {
  watch();
  accept_loop_ = clock_.now();
  EXPECT_THAT(in(7s), Each("WATCHDOG=1"));
  EXPECT_THAT(in(3s), Contains("WATCHDOG=trigger"));
  EXPECT_THAT(in(10s), Not(Contains("WATCHDOG=1")));
}

TEST_F(WatchTest, WhereGrpcTakesNobodyInNothingIsTold) {
  watch();
  hand_over_ = clock_.now();
  EXPECT_THAT(in(7s), Each("WATCHDOG=1"));
  (void)in(2s);
  EXPECT_THAT(in(10s), IsEmpty());
  hand_over_.reset();
  EXPECT_THAT(in(2s), Contains("WATCHDOG=1"));
}

TEST_F(WatchTest, WhereNobodyWatchesNobodyIsTold) {
  watch(0s);
  accept_loop_ = clock_.now();
  EXPECT_THAT(in(10s), IsEmpty());
}

}  // namespace
}  // namespace axisd::cell
