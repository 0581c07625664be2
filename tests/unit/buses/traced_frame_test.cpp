#include "buses/traced_frame.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace axisd {
namespace {

std::string line(const TracedFrame& frame) {
  std::string text;
  append_line(text, "line-a", frame);
  return text;
}

TEST(TracedFrame, HasALineForEachThingThatHappensOnALine) {
  const std::vector<std::uint8_t> bytes = {0x01, 0x03, 0xAB};
  TracedFrame frame{.at = TimePoint(Duration(17)), .node = 1, .bytes = bytes};
  EXPECT_EQ(line(frame), "17 line-a tx 01 03 AB @parameters\n");
  frame.kind = TracedFrame::Kind::received;
  EXPECT_EQ(line(frame), "17 line-a rx 01 03 AB @parameters\n");
  frame.kind = TracedFrame::Kind::not_sent;
  frame.transaction_class = TransactionClass::motion;
  frame.why = "superseded";
  EXPECT_EQ(line(frame), "17 line-a -- 01 03 AB not sent: superseded @motion\n");
  frame.kind = TracedFrame::Kind::failed;
  frame.why = "timeout";
  EXPECT_EQ(line(frame), "17 line-a -- timeout @motion\n");
}

TEST(TracedFrame, ShowsCanFramesAsCandumpDoes) {
  const std::vector<std::uint8_t> bytes = {0x40, 0x41, 0x60, 0, 0, 0, 0, 0};
  const auto sent = can::make_frame(0x605, bytes);
  TracedFrame frame{.at = TimePoint(Duration(17))};
  frame.set(sent);
  EXPECT_EQ(frame.node, 5);
  EXPECT_EQ(frame.frame(), sent);
  EXPECT_EQ(line(frame), "17 line-a tx 605#4041600000000000 @parameters\n");
  frame.kind = TracedFrame::Kind::not_sent;
  frame.why = "port_down";
  EXPECT_EQ(line(frame), "17 line-a -- 605#4041600000000000 port_down @parameters\n");
  frame.kind = TracedFrame::Kind::failed;
  frame.why = "unknown";
  EXPECT_EQ(line(frame), "17 line-a -- 605#4041600000000000 unknown @parameters\n");
  frame.kind = TracedFrame::Kind::received;
  EXPECT_EQ(line(frame), "17 line-a rx 605#4041600000000000\n") << "nobody asked for it";
  frame.kind = TracedFrame::Kind::link;
  frame.why = "bus_off";
  EXPECT_EQ(line(frame), "17 line-a link bus_off\n");
}

TEST(TracedFrame, BelongsToNoNodeWithAnIdentifierOf29Bits) {
  TracedFrame frame;
  const can::Frame extended{.id = 0x605, .extended = true};
  frame.set(extended);
  EXPECT_EQ(frame.node, 0);
  EXPECT_EQ(line(frame), "0 line-a tx 00000605# @parameters\n");
}

}  // namespace
}  // namespace axisd
