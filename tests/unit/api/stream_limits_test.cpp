// Whose streams are too many.
#include "api/transport/stream_limits.hpp"

#include <gmock/gmock.h>

namespace axisd::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using transport::beyond;
using transport::StreamLimits;

constexpr StreamLimits limits{.of_one = 10, .idle = 20};

/// So many, all of them idle for a while.
transport::OpenStreams idle(std::int64_t streams) { return {.open = streams, .idle_before = streams}; }

TEST(StreamLimits, OneHasNoMoreThanItsShare) {
  EXPECT_THAT(beyond(limits, {}), IsEmpty());
  EXPECT_THAT(beyond(limits, {{1, {.open = 10, .in_progress = 10}}}), IsEmpty());
  EXPECT_THAT(beyond(limits, {{1, {.open = 11, .in_progress = 11}}, {2, idle(3)}}), ElementsAre(1));
}

TEST(StreamLimits, WhoHasMostIdleOnesIsCutOffUntilTheyAreFewEnough) {
  EXPECT_THAT(beyond(limits, {{1, idle(10)}, {2, idle(10)}}), IsEmpty());
  EXPECT_THAT(beyond(limits, {{1, idle(5)}, {2, idle(9)}, {3, idle(8)}}), ElementsAre(2));
  EXPECT_THAT(beyond(limits, {{1, idle(9)}, {2, idle(10)}, {3, idle(9)}, {4, idle(9)}}), ElementsAre(2, 4));
}

TEST(StreamLimits, WhoIsCutOffAnywayIsNotCountedAgainstOthers) {
  EXPECT_THAT(beyond(limits, {{1, idle(1000)}, {2, idle(10)}, {3, idle(10)}}), ElementsAre(1));
}

TEST(StreamLimits, CallsInProgressCutOffNobody) {
  EXPECT_THAT(beyond(limits, {{1, {.open = 10, .in_progress = 10}},
                              {2, {.open = 10, .in_progress = 10}},
                              {3, {.open = 10, .in_progress = 9, .idle_before = 1}},
                              {4, idle(9)},
                              {5, idle(7)},
                              {6, idle(5)}}),
              ElementsAre(4));
  EXPECT_EQ((transport::OpenStreams{.open = 2, .in_progress = 3}.idle()), 0) << "counted a moment later";
}

TEST(StreamLimits, SoDoNotStreamsThatPassBy) {
  EXPECT_THAT(beyond(limits, {{1, {.open = 10, .idle_before = 0}}, {2, idle(9)}, {3, idle(8)}}), IsEmpty());
  EXPECT_THAT(beyond(limits, {{1, {.open = 10, .idle_before = 4}}, {2, idle(9)}, {3, idle(8)}}),
              ElementsAre(2));
}

}  // namespace
}  // namespace axisd::testing
