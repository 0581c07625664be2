// M5 on drives by CiA 402: what their error code says, and what it does not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/rules/model_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr int following_error = 0x8611;

void raise_in_mid_move(ModelRig& rig) {
  ASSERT_EQ(rig.complete(EnableRequest{}).state, CommandState::done);
  ASSERT_EQ(rig.complete(SetPositionRequest{.position = 100}).state, CommandState::done);
  const auto move = rig.try_submit(MoveRelativeRequest{.distance = 50});
  ASSERT_TRUE(move) << to_string(move.error());
  rig.run(400ms);
  rig.touch([](auto& node) { node.raise_alarm(following_error); });
  rig.run(500ms);
}

/// 603Fh may go on telling of the last error: after Reset it is none.
TEST(M05, AnErrorCodeThatIsKeptIsNoAlarm) {
  for (const bool kept : {false, true}) {
    SCOPED_TRACE(kept);
    ModelRig rig({.model = "cia402", .switches = {{"error_code_kept", kept}}});
    raise_in_mid_move(rig);
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    EXPECT_EQ(rig.state()->alarm_code, following_error);
    EXPECT_EQ(rig.state()->alarm_name, "following_error");
    ASSERT_TRUE(rig.state()->fault);
    EXPECT_THAT(rig.state()->fault->message, HasSubstr("alarm 8611h (following_error)"));
    const auto begun = rig.world.now();
    const auto reset = rig.complete(ResetRequest{});
    EXPECT_EQ(reset.state, CommandState::done) << (reset.cause ? to_string(*reset.cause) : "");
    EXPECT_LT(rig.world.now() - begun, 1s);
    rig.run(2s);
    EXPECT_EQ(rig.state()->alarm_code, 0);
    EXPECT_FALSE(rig.state()->fault);
    EXPECT_EQ(rig.complete(EnableRequest{}).state, CommandState::done);
    EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 5}).state, CommandState::done);
  }
}

/// A daemon that starts beside such a drive finds no alarm either.
TEST(M05, AnErrorOfTheDrivesPastIsNoneAtTheStart) {
  ModelRig rig({.model = "cia402", .switches = {{"error_code_kept", true}}});
  raise_in_mid_move(rig);
  ASSERT_EQ(rig.complete(ResetRequest{}).state, CommandState::done);
  rig.stop_daemon();
  rig.start_daemon();
  rig.run(1s);
  EXPECT_EQ(rig.state()->alarm_code, 0);
  EXPECT_FALSE(rig.state()->fault);
}

/// Without 603Fh the EMCY alone says which alarm it is, for as long as the drive is in Fault.
TEST(M05, ADriveWithoutAnErrorCodeShowsThatOfItsEmergency) {
  ModelRig rig({.model = "cia402", .drive_keys = "objects: { 603Fh: { access: none } }"});
  raise_in_mid_move(rig);
  rig.run(3s);
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  EXPECT_EQ(rig.state()->alarm_code, following_error);
  ASSERT_TRUE(rig.state()->fault);
  EXPECT_THAT(rig.state()->fault->message, HasSubstr("8611h"));
  EXPECT_EQ(rig.complete(ResetRequest{}).state, CommandState::done);
  rig.run(1s);
  EXPECT_EQ(rig.state()->alarm_code, 0);
  // One that was not heard of: the daemon came later.
  rig.touch([](auto& node) { node.raise_alarm(following_error); });
  rig.stop_daemon();
  rig.start_daemon();
  rig.run(1s);
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  ASSERT_TRUE(rig.state()->fault);
  EXPECT_THAT(rig.state()->fault->message, HasSubstr("alarm without a code"));
}

}  // namespace
}  // namespace axisd::test
