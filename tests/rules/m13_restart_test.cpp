// A drive that is restarted while its stop is being confirmed (M13).
#include <gtest/gtest.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

/// A drive that brakes for 2 s is found restarted, so that nobody polls it any more.
struct Restarted {
  Restarted() {
    rig.ready();
    rig.submit(MoveAbsoluteRequest{
        .position = 390, .with = {.velocity = 100, .acceleration_time = 200ms, .deceleration_time = 2000ms}});
    rig.run(900ms);
    // Before the canary is read; then it boots while that reading waits.
    rig.fault({.kind = FaultKind::reboot_before, .function = 0x03, .register_address = 0x0020, .delay = 1ms});
    stop = rig.submit(StopRequest{});
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 2s));
    EXPECT_FALSE(stop->has_ended()) << describe(stop->value());
  }

  Rig rig{{.adjust = [](AxisSettings& axis) { axis.turnaround_max = 400ms; }}};
  CommandPtr stop;
};

TEST(M13, AStopIsConfirmedByADriveThatWasRestarted) {
  Restarted on;
  EXPECT_TRUE(on.rig.run_until([&] { return on.stop->has_ended(); }, 1s));
  EXPECT_EQ(on.stop->value().state, CommandState::done) << describe(on.stop->value());
  on.rig.reconnect();
}

/// Nobody but the stop itself looks whether it rests.
TEST(M13, AStopEndsThoughItsDriveFallsSilentAfterARestart) {
  for (const bool port : {false, true}) {
    SCOPED_TRACE(port ? "the port closes" : "the cable is cut");
    Restarted on;
    auto& rig = on.rig;
    const auto set_reachable = [&](bool reachable) {
      port ? rig.line->set_open(reachable) : rig.line->network().set_connected(reachable);
    };
    set_reachable(false);
    EXPECT_TRUE(rig.run_until([&] { return on.stop->has_ended(); }, 20s)) << "stops for ever";
    EXPECT_EQ(on.stop->value().state, CommandState::unknown) << describe(on.stop->value());
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    rig.line->forget_wire();
    set_reachable(true);
    rig.reconnect();
    EXPECT_GE(rig.writes_of(0x0028), 1) << "it is owed";
  }
}

}  // namespace
}  // namespace axisd::test
