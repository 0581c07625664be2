// M3: a comparison with the configuration goes on beside whatever its axis does, and ends with what it would
// say something of.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "tests/rules/shared_line.hpp"
#include "tests/support/indexing.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t x1_function = 0x0044;

void compare_each_second(AxisSettings& axis) { axis.drift_check = 1s; }

/// What the configuration owns is read: not the state, the canary or the identity.
bool is_of_a_comparison(const WireEntry& entry) {
  return !entry.is_write() && (entry.address() >= 0x0040 || entry.address() / 0x10 == 1);
}

/// Calls `begun` as the first frame of the next comparison with `node` goes out, once.
void on_comparison(VirtualLine& line, std::uint8_t node, const std::function<void()>& begun) {
  line.set_on_bind([&line, node, begun](const WireEntry& entry) {
    if (entry.node() != node || !is_of_a_comparison(entry)) return;
    const auto once = begun;  // this function goes away
    line.set_on_bind({});
    once();
  });
}

/// A silent drive answers none of it: each of its readings would wait for its probe, three times.
TEST(M3, AnAxisThatIsExchangedWaitsForNoComparisonWithASilentDrive) {
  for (const auto silent : {100ms, 400ms, 1000ms, 4000ms}) {
    SCOPED_TRACE(silent.count());
    Rig rig({.adjust = compare_each_second});
    bool begun = false;
    on_comparison(*rig.line, 1, [&] {
      rig.line->network().set_connected(false);
      begun = true;
    });
    ASSERT_TRUE(rig.run_until([&] { return begun; }, 3s));
    rig.run(silent);
    rig.axis().retire(true);
    EXPECT_TRUE(rig.run_until([&] { return rig.axis().closed(); }, 2500ms)) << "one probe";
  }
}

/// On a full line it gets no more than its share of the reservation.
TEST(M3, AnAxisThatIsExchangedWaitsForNoComparisonOnAFullLine) {
  constexpr int others = 8;
  SharedLine line(others + 1, 115200, compare_each_second);
  std::vector<std::string> names;
  for (int i = 1; i <= others; ++i) names.push_back("a" + std::to_string(i));
  IndexingAxes indexing(line.world, line.machine(), names);
  indexing.make_ready();
  auto& axis = *line.machine().find("a9");
  ASSERT_TRUE(line.world.run_until([&] { return axis.snapshot()->link == LinkState::online; }, 10s));
  indexing.run(2s);
  bool begun = false;
  on_comparison(*line.line, others + 1, [&] { begun = true; });
  for (int i = 0; i < 10'000 && !begun; ++i) indexing.run(1ms);
  ASSERT_TRUE(begun);
  axis.retire(true);
  const auto since = line.world.now();
  while (!axis.closed() && line.world.now() < since + 10s) indexing.run(1ms);
  EXPECT_LE(line.world.now() - since, 300ms);
  EXPECT_EQ(indexing.failures, std::vector<std::string>{});
}

/// What a client writes in the meantime is not what somebody else has changed. It is compared anew after
/// that.
TEST(M3, WhatIsWrittenDuringAComparisonIsNoDrift) {
  Rig rig({.adjust = compare_each_second});
  rig.complete(DisableRequest{});
  bool begun = false;
  on_comparison(*rig.line, 1, [&] { begun = true; });
  ASSERT_TRUE(rig.run_until([&] { return begun; }, 3s));
  auto maintenance = rig.axis().begin_maintenance();
  ASSERT_TRUE(maintenance) << to_string(maintenance.error());
  rig.write_behind(x1_function, 0);
  rig.run(3s);
  EXPECT_EQ(rig.state()->drift, "");
  EXPECT_EQ(rig.state()->link, LinkState::online);
  maintenance->reset();
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::configuring; }, 1s));
  rig.reconnect();
  EXPECT_NE(rig.drive->peek(x1_function), 0);
}

}  // namespace
}  // namespace axisd::test
