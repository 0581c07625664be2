// M6 on CAN where the SDO server of a drive is slow: what is proven fits into reboot_guard, or nothing
// starts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// Each answer of the drive comes so late from now on.
void answer_late(CanRig& rig, Duration delay) {
  rig.nodes().clear_faults();
  rig.nodes().add_fault({.kind = simulation::FaultKind::delay_reply, .count = -1, .delay = delay});
}

TEST(M06, SlowAnswersPermitMoves) {
  for (const auto* model : {"yss-c", "cia402"}) {
    for (const auto delay : {20ms, 40ms, 60ms}) {
      SCOPED_TRACE(std::string(model) + ' ' + std::to_string(delay.count()));
      CanRig rig({.model = model, .adjust = [](AxisSettings& axis) { axis.start_within = 5s; }});
      rig.ready();
      answer_late(rig, delay);
      const auto before = rig.shaft();
      rig.done(MoveAbsoluteRequest{.position = 10});
      EXPECT_NE(rig.shaft(), before);
      rig.done(MoveRelativeRequest{.distance = 2});
    }
  }
}

/// Where it cannot be proven in time nothing is sent, and the error says what to do.
TEST(M06, AnswersThatAreTooLateStartNothing) {
  CanRig rig({.adjust = [](AxisSettings& axis) {
    axis.start_within = 10s;
    axis.reboot_guard = 30ms;
  }});
  rig.ready();
  rig.done(MoveAbsoluteRequest{.position = 5});
  answer_late(rig, 60ms);
  const auto starts = rig.drive->starts();
  const auto move = rig.complete(MoveAbsoluteRequest{.position = 10});
  EXPECT_NE(move.state, CommandState::done);
  ASSERT_TRUE(move.cause);
  EXPECT_EQ(move.cause->reason, Reason::expired) << to_string(*move.cause);
  EXPECT_THAT(move.cause->message, HasSubstr("ms to answer"));
  EXPECT_THAT(move.cause->remedy, HasSubstr("raise reboot_guard"));
  EXPECT_EQ(rig.drive->starts(), starts);
}

}  // namespace
}  // namespace axisd::test
