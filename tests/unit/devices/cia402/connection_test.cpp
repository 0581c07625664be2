// First contact with simulated YSS-Cs.
#include <gtest/gtest.h>

#include "tests/unit/devices/cia402/drive_bench.hpp"

namespace axisd::cia402 {
namespace {

/// Two motors would turn on one command. The second need not answer soon after the first.
TEST(Cia402Connection, ASecondDriveWithTheSameNodeIdIsNoticedThoughItAnswersLate) {
  DriveBench bench;
  simulation::NetworkNodes others(bench.world().clock(), bench.network());
  others.nodes().add(std::make_unique<yss_c::SimulatedDrive>(
      simulation::SimulatedNodeSettings{.address = DriveBench::node}));
  others.nodes().add_fault(simulation::Fault{
      .kind = simulation::FaultKind::delay_reply, .count = -1, .delay = std::chrono::seconds(2)});
  bench.world().run_for(std::chrono::seconds(1));  // it boots before it is looked for
  bench.bring_up();
  bench.world().run_for(std::chrono::seconds(3));
  const auto checked = bench.run(bench.drive().check_continuity(TransactionClass::parameters));
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().reason, Reason::misconfigured) << to_string(checked.error());
  const auto moved = bench.run(bench.drive().enable({}));
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().reason, Reason::misconfigured) << to_string(moved.error());
}

}  // namespace
}  // namespace axisd::cia402
