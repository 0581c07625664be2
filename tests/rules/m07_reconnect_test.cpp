// A drive that is restarted while its axis is finding it again (M7).
#include <gtest/gtest.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

constexpr std::uint16_t canary = 0x0020;

/// What was proven when the drive answered again says nothing of what follows seconds later.
TEST(M07, PowerCycleWhileTheAxisIsConnecting) {
  // Each reading in vain takes a second, and is repeated twice.
  RigOptions slow;
  slow.adjust = [](AxisSettings& axis) { axis.turnaround_max = 1s; };
  both_directions(slow, [](const RigOptions& options) {
    for (const auto off : {1500ms, 2500ms, 3500ms}) {
      SCOPED_TRACE(off.count());
      Rig rig(options);
      rig.ready();
      EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
      rig.fault({.kind = FaultKind::drop_request, .count = -1});
      ASSERT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 20s));
      bool proven = false, lost = false;
      rig.line->set_on_bind([&](const WireEntry& entry) {
        if (entry.address() == canary && !entry.is_write())
          proven = true;
        else if (std::exchange(proven, false) && !std::exchange(lost, true))
          rig.drive->set_power(false);
      });
      rig.faults().clear();
      ASSERT_TRUE(rig.run_until([&] { return lost; }, 30s));
      rig.cycle_power(off);
      for (int i = 0; i < 20000; ++i) {
        rig.run(1ms);
        const auto state = rig.state();
        if (state->link == LinkState::online && state->trust != PositionTrust::unknown)
          ASSERT_EQ(state->position, 10) << i;
      }
      EXPECT_EQ(rig.state()->reboots, 1);
    }
  });
}

}  // namespace
}  // namespace axisd::test
