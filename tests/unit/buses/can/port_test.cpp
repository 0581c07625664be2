#include "buses/can/port.hpp"

#include <gtest/gtest.h>

#include "tests/unit/buses/can/frames.hpp"

namespace axisd::can {
namespace {

using test::frame_of;

TEST(CanFrame, IsValidWithinItsRangesOnly) {
  EXPECT_TRUE(valid(frame_of(0x7FF, {1, 2, 3, 4, 5, 6, 7, 8})));
  EXPECT_TRUE(valid({.id = 0x1FFFFFFF, .extended = true}));
  EXPECT_TRUE(valid({.id = 1, .rtr = true, .size = 8}));
  EXPECT_FALSE(valid({.id = 0x800}));
  EXPECT_FALSE(valid({.id = 0x20000000, .extended = true}));
  EXPECT_FALSE(valid({.id = 1, .size = 9}));
  EXPECT_FALSE(valid({.id = 1, .size = 1, .data = {1, 2}}));
  EXPECT_FALSE(valid({.id = 1, .rtr = true, .size = 2, .data = {1}}));
}

TEST(CanFrame, IsWrittenAsCandumpDoes) {
  EXPECT_EQ(to_string(frame_of(0x601, {0x40, 0x41, 0x60, 0})), "601#40416000");
  EXPECT_EQ(to_string(frame_of(0x80)), "080#");
  EXPECT_EQ(to_string(Frame{.id = 0x123, .extended = true, .rtr = true}), "00000123#R");
  EXPECT_EQ(to_string(Frame{.id = 5, .rtr = true, .size = 4}), "005#R4");
}

TEST(CanFrame, TakesAtMostWhatTheStandardSays) {
  EXPECT_EQ(worst_case_bits(frame_of(1, {1, 2, 3, 4, 5, 6, 7, 8})), 135);  // 11-bit id, 8 bytes
  EXPECT_EQ(worst_case_bits(frame_of(1)), 55);
  EXPECT_EQ(worst_case_bits({.id = 1, .extended = true, .size = 8}), 160);
  EXPECT_EQ(worst_case_bits({.id = 1, .rtr = true, .size = 8}), 55);  // carries no data
}

TEST(CanSendResult, BecomesAnErrorThatSaysWhetherItMayHaveBeenSent) {
  const auto error = error_of({.status = SendStatus::unknown}, "can0", frame_of(0x205, {0x0F}));
  EXPECT_EQ(error.reason, Reason::no_reply);
  EXPECT_EQ(error.outcome, Outcome::unknown);
  EXPECT_EQ(error.where.bus, "can0");
  EXPECT_NE(error.message.find("205#0F"), std::string::npos);

  const std::pair<SendStatus, Reason> not_sent[] = {
      {SendStatus::superseded, Reason::superseded}, {SendStatus::expired, Reason::expired},
      {SendStatus::lease_lost, Reason::lease_lost}, {SendStatus::port_down, Reason::bus_down},
      {SendStatus::queue_full, Reason::busy},       {SendStatus::invalid, Reason::internal}};
  for (const auto& [status, reason] : not_sent) {
    const auto other = error_of({.status = status}, "can0", frame_of(1));
    EXPECT_EQ(other.reason, reason) << to_string(status);
    EXPECT_EQ(other.outcome, Outcome::not_sent) << to_string(status);
  }
}

}  // namespace
}  // namespace axisd::can
