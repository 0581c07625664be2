// M5 on drives by CiA 402: what their error code says, and what it does not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/rules/m23_can_rig.hpp"
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

/// Without 603Fh, and with its state asked for object by object.
CanRigOptions asked_for_each_object() {
  CanRigOptions options{.model = "cia402", .polled = true};
  options.adjust = [](AxisSettings& axis) {
    axis.model_settings["objects.603Fh:00.access"] = std::string("none");
    const auto* model = find_drive_model("cia402");
    auto made = model->specialise(*model, axis.model_settings);
    if (!made) throw std::invalid_argument(to_string(made.error()));
    axis.own_descriptor = *made;
  };
  return options;
}

bool is_reset(const can::Frame& frame) {
  return frame.id == 0x80U + CanRig::node_id && frame.data[0] == 0 && frame.data[1] == 0;
}

/// A fault that is over by the time it is told has lost its code with the EMCY, and is no other one: at
/// whatever point of a reading the reset falls, and also where its EMCY is lost.
TEST(M05, AResetIsDoneWhateverOfTheStateIsBeingRead) {
  for (const bool told : {true, false}) {
    CanRig rig(asked_for_each_object());
    rig.network.set_fault(
        [told](const can::Frame& frame) { return can::Network::Fault{.drop = !told && is_reset(frame)}; });
    for (int step = 0; step < 60; ++step) {
      SCOPED_TRACE(testing::Message() << (told ? "with its EMCY, " : "without, ") << step);
      rig.touch([](auto& node) { node.raise_alarm(following_error); });
      rig.run(300ms);
      ASSERT_EQ(rig.state()->state, AxisState::error_stop);
      ASSERT_EQ(rig.state()->alarm_code, following_error);
      rig.run(step * 700us);
      const auto reset = rig.complete(ResetRequest{});
      ASSERT_EQ(reset.state, CommandState::done) << describe(reset);
      rig.run(20ms);
      ASSERT_FALSE(rig.state()->fault) << to_string(*rig.state()->fault);
    }
  }
}

/// The same where somebody else resets it, between the status word and the rest of a reading.
TEST(M05, AFaultThatWasResetWhileItWasReadIsNoOther) {
  CanRig rig(asked_for_each_object());
  rig.touch([](auto& node) { node.raise_alarm(following_error); });
  rig.run(1s);
  ASSERT_EQ(rig.state()->alarm_code, following_error);
  std::vector<int> shown;
  bool struck = false;
  rig.network.set_fault([&](const can::Frame& frame) {
    const bool fault_read = frame.id == 0x580U + CanRig::node_id && frame.data[1] == 0x41 &&
                            frame.data[2] == 0x60 && (frame.data[4] & 0x4FU) == 0x08;
    if (fault_read && !struck) {
      struck = true;
      for (const std::uint8_t word : {0x00, 0x80})
        rig.drive->on_frame({.id = 0x600U + CanRig::node_id, .size = 8, .data = {0x2B, 0x40, 0x60, 0, word}});
    }
    shown.push_back(rig.state()->alarm_code);
    return can::Network::Fault{};
  });
  rig.run(2s);
  EXPECT_TRUE(struck);
  EXPECT_THAT(shown, testing::Each(testing::AnyOf(following_error, 0)));
  EXPECT_EQ(rig.state()->alarm_code, 0);
  ASSERT_TRUE(rig.state()->fault) << "it latches until it is reset here";
  EXPECT_THAT(rig.state()->fault->message, HasSubstr("8611h"));
  EXPECT_EQ(rig.complete(ResetRequest{}).state, CommandState::done);
}

}  // namespace
}  // namespace axisd::test
