// Open loop: a stop without a ramp loses the position when it may have reached the drive, confirmed or not.
#include <cmath>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

TEST(M20QuickStop, OfWhichTheDriveToldNothingLosesThePosition) {
  Rig rig({.switches = {{"abrupt_stop_slips", true}}});
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(500ms);
  rig.fault({.kind = FaultKind::drop_reply, .count = -1});
  const auto stop = rig.submit(StopRequest{.kind = StopKind::quick_stop});
  ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 20s));
  EXPECT_EQ(stop->value().state, CommandState::unknown) << "the drive fell silent";
  rig.faults().clear();
  rig.reconnect();
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  EXPECT_GT(std::abs(rig.load_mm() - rig.state()->position), 0.1) << "it slipped";
}

}  // namespace
}  // namespace axisd::test
