#include "api/axisctl/format.hpp"

#include <gtest/gtest.h>

namespace axisd::axisctl {
namespace {

TEST(Format, NumbersAreShort) {
  EXPECT_EQ(number(0), "0");
  EXPECT_EQ(number(-0.0), "0");
  EXPECT_EQ(number(-0.00001), "-1e-05");
  EXPECT_EQ(number(120), "120");
  EXPECT_EQ(number(49.95), "49.95");
  EXPECT_EQ(number(1.0 / 3), "0.3333");
  EXPECT_EQ(number(1234567.25), "1234567.25");
  EXPECT_EQ(number(100), "100");
}

TEST(Format, UnitsAndTimes) {
  EXPECT_EQ(with_unit(12.5, "mm"), "12.5 mm");
  EXPECT_EQ(with_unit(12.5, ""), "12.5");
  EXPECT_EQ(with_unit(12.5, "/s"), "12.5/s");
  EXPECT_EQ(duration_text(0.15), "150 ms");
  EXPECT_EQ(duration_text(2.4), "2.4 s");
  EXPECT_EQ(duration_text(185), "3 min 5 s");
}

TEST(Format, WordsOfEnums) {
  EXPECT_EQ(camel_word("STATE_DISCRETE_MOTION", "STATE_"), "DiscreteMotion");
  EXPECT_EQ(lower_word("REASON_SOFT_LIMIT", "REASON_"), "soft limit");
  v1::AxisState state;
  state.set_state(v1::STATE_ERROR_STOP);
  EXPECT_EQ(state_text(state), "ErrorStop");
  state.set_link(v1::LINK_STATE_OFFLINE);
  EXPECT_EQ(state_text(state), "Offline");
}

v1::Command move_command() {
  v1::Command command;
  command.set_id("c-17");
  command.set_axis("feeder");
  command.set_kind(v1::COMMAND_KIND_MOVE_ABSOLUTE);
  command.set_state(v1::COMMAND_STATE_ACTIVE);
  command.mutable_asked()->set_position(120);
  command.mutable_asked()->set_velocity(50);
  *command.mutable_granted() = command.asked();
  return command;
}

TEST(Format, GrantedValuesShowOnlyWhereTheyDiffer) {
  auto command = move_command();
  EXPECT_EQ(command_line(command, "mm"), "c-17  feeder  MoveAbsolute  Active");
  command.mutable_granted()->set_velocity(49.95);
  command.mutable_asked()->mutable_acceleration_time()->set_nanos(150'400'000);
  command.mutable_granted()->mutable_acceleration_time()->set_nanos(150'000'000);
  EXPECT_EQ(command_line(command, "mm"),
            "c-17  feeder  MoveAbsolute  Active  granted velocity 49.95 mm/s (asked 50 mm/s), "
            "acceleration time 150 ms (asked 150.4 ms)");
  command.mutable_granted()->set_velocity(50.000001);
  EXPECT_FALSE(granted_text(command, "mm").contains("velocity"));
}

TEST(Format, EndedCommandsTellCauseAndTime) {
  auto command = move_command();
  command.set_state(v1::COMMAND_STATE_ABORTED);
  command.mutable_accepted_at()->set_seconds(100);
  command.mutable_ended_at()->set_seconds(102);
  command.mutable_ended_at()->set_nanos(400'000'000);
  command.mutable_cause()->set_reason(v1::REASON_LIMIT_SWITCH);
  command.mutable_cause()->set_message("X1 positive_limit became active");
  command.mutable_cause()->set_remedy("move away from it");
  EXPECT_EQ(
      command_line(command, "mm"),
      "c-17  feeder  MoveAbsolute  Aborted after 2.4 s: X1 positive_limit became active; move away from it");
  EXPECT_TRUE(ended(command));
  EXPECT_FALSE(ended(move_command()));
}

TEST(Format, AddressesAreThoseOfTheManuals) {
  EXPECT_EQ(address_text(0x0027), "0x0027");
  EXPECT_EQ(address_text(0xFFFF), "0xFFFF");
  EXPECT_EQ(address_text(0x604100), "6041h:00");
  EXPECT_EQ(address_text(0x20300C), "2030h:0C");
}

TEST(Format, JsonKeepsTheNamesOfTheProtoAndZeros) {
  const std::string text = json(move_command());
  EXPECT_TRUE(text.contains(R"("request_id":"")")) << text;
  EXPECT_TRUE(text.contains(R"("kind":"COMMAND_KIND_MOVE_ABSOLUTE")")) << text;
  EXPECT_FALSE(text.contains('\n'));
}

}  // namespace
}  // namespace axisd::axisctl
