// A drive that is restarted while its axis is finding it again, and what is told of a lost canary (M7).
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

/// It is taken for a restart either way; but who looks for the cause is to find it.
TEST(M07, ParametersThatAnotherMasterWroteAreToldAsWhatTheyMayBe) {
  constexpr std::uint16_t factory[] = {5, 100, 100, 60, 0, 5000};
  for (const bool restarted : {true, false}) {
    Rig rig;
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(300ms);
    for (std::uint16_t i = 0; i < std::size(factory); ++i)
      rig.write_behind(static_cast<std::uint16_t>(canary + i),
                       static_cast<std::uint16_t>(factory[i] + (restarted ? 0 : 1)));
    ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 2s));
    const auto& cause = move->value().cause;
    ASSERT_TRUE(cause) << describe(move->value());
    EXPECT_EQ(cause->reason, Reason::rebooted);
    EXPECT_EQ(cause->message.find("another master wrote") == std::string::npos, restarted) << cause->message;
  }
}

}  // namespace
}  // namespace axisd::test
