#include "api/cell/clock_samples.hpp"

#include <gmock/gmock.h>

#include <utility>

#include "api/cell/peer_clocks.hpp"

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

PeerClocks::Reading reading_of(const std::string& instance_id, TimePoint sent, Duration ahead) {
  return {.instance_id = instance_id,
          .sent = sent,
          .received = sent + 2ms,
          .clock = (sent + 1ms).time_since_epoch() + ahead};
}

TEST(PeerClocks, TellAnOffsetOnceThereIsOne) {
  PeerClocks clocks;
  EXPECT_FALSE(clocks.of("press-2", TimePoint(1s)));
  clocks.answered("press-2", reading_of("run-1", TimePoint(10s), 1h));
  const auto found = clocks.of("press-2", TimePoint(12s));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->offset, Duration(1h));
  EXPECT_EQ(found->error,
            Duration(1ms) + std::chrono::duration_cast<Duration>((2s - 1ms) * ClockSamples::drift));
  EXPECT_FALSE(clocks.of("press-3", TimePoint(12s)));
}

TEST(PeerClocks, KeepNothingOfAComputerThatWasStartedAnew) {
  PeerClocks clocks;
  clocks.answered("press-2", reading_of("run-1", TimePoint(10s), 1h));
  clocks.answered("press-2", reading_of("run-2", TimePoint(12s), -5s));
  // The nearest sample would be that of the earlier run.
  EXPECT_EQ(clocks.of("press-2", TimePoint(10s))->offset, Duration(-5s));
  clocks.failed("press-2");
  EXPECT_FALSE(clocks.of("press-2", TimePoint(12s)));
}

TEST(PeerClocks, ForgetWhoIsKnownNoMore) {
  PeerClocks clocks;
  for (const auto* name : {"press-2", "press-3"})
    clocks.answered(name, reading_of("run-1", TimePoint(10s), 1h));
  clocks.forget_if([](const std::string& name) { return name == "press-3"; });
  EXPECT_TRUE(clocks.of("press-2", TimePoint(10s)));
  EXPECT_FALSE(clocks.of("press-3", TimePoint(10s)));
}

}  // namespace
}  // namespace axisd::cell
