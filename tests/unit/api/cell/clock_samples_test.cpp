#include "api/cell/clock_samples.hpp"

#include <gmock/gmock.h>

#include <utility>

namespace axisd::cell {
namespace {

using namespace std::chrono_literals;

TEST(ClockSamples, TheOffsetIsInsideItsBound) {
  ClockSamples samples;
  EXPECT_FALSE(samples.at(TimePoint(1s)));
  // The other clock is 1000 s ahead; ways there and back are as unequal as they can be.
  for (const auto& [there, back] : {std::pair{3ms, 1ms}, {0ms, 400ms}, {2ms, 0ms}, {9ms, 0ms}}) {
    const TimePoint sent(10s);
    samples.add(sent, sent + there + back, (sent + there).time_since_epoch() + 1000s);
    const auto found = *samples.at(sent);
    EXPECT_LE(std::chrono::abs(found.offset - Duration(1000s)), found.error);
  }
  EXPECT_LT(samples.at(TimePoint(10s))->error, 1100us) << "by the shortest round trip";
  EXPECT_GT(samples.at(TimePoint(20s))->error, 2ms) << "they drift apart";
}

}  // namespace
}  // namespace axisd::cell
