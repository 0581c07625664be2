// M1: what a drive that was restarted may be told before a client has enabled it.
#include "tests/rules/explain_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::HasSubstr;

/// Whoever switched it off may have done so to reach into the machine, and it comes up energised.
TEST(M01, ARestartedDriveStartsNothingUntilItIsEnabled) {
  both_directions({}, [](const RigOptions& options) {
    ExplainRig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    rig.cycle_power(10ms);
    ASSERT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 5s));
    rig.reconnect();
    ASSERT_TRUE(rig.state()->enabled);
    EXPECT_EQ(rig.state()->state, AxisState::standstill) << "as the drive is";
    rig.line->forget_wire();
    const auto starts = rig.drive->starts();
    const Action actions[] = {HomeRequest{}, MoveRelativeRequest{.distance = 1},
                              MoveAbsoluteRequest{.position = 1}, JogRequest{.velocity = 5},
                              MoveVelocityRequest{.velocity = 5}};
    for (const auto& action : actions) {
      EXPECT_THAT(rig.reasons(action), Contains("disabled")) << to_string(kind_of(action));
      EXPECT_EQ(rig.try_submit(action).error().reason, Reason::disabled) << to_string(kind_of(action));
    }
    EXPECT_THAT(rig.text(MoveRelativeRequest{.distance = 1}, Reason::disabled),
                HasSubstr("axisctl enable feeder"));
    rig.run(2s);
    EXPECT_EQ(rig.triggers(), 0);
    EXPECT_EQ(rig.drive->starts(), starts);
    rig.enable();
    EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 1}).state, CommandState::done);
  });
}

/// The axis that comes after it would know nothing of the restart.
TEST(M01, ARestartedDriveIsNotGivenToAnotherAxisBeforeItIsEnabled) {
  Rig rig;
  rig.ready();
  EXPECT_TRUE(rig.axis().check_exchange(true).empty());
  rig.cycle_power(10ms);
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 5s));
  rig.reconnect();
  ASSERT_TRUE(rig.state()->enabled);
  const auto refused = rig.axis().check_exchange(true);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_THAT(refused[0].message, HasSubstr("switched off and on"));
  rig.enable();
  EXPECT_TRUE(rig.axis().check_exchange(true).empty());
}

/// Nobody knows of a restart: it may have been energised, and at work, all the time.
TEST(M01, ADriveThatIsFoundEnergisedMayMove) {
  Rig rig;
  ASSERT_FALSE(rig.state()->enabled_by_us);
  EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 1}).state, CommandState::done);
}

}  // namespace
}  // namespace axisd::test
