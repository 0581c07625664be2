#include "api/web/gateway/lane_message.hpp"

#include <gtest/gtest.h>

namespace axisd::web {
namespace {

using namespace std::string_literals;

TEST(LaneMessage, IsRead) {
  const auto bytes = "\1\0\0\1\2\0\0\0\x0A\3abcxyz"s;
  const auto request = parse_lane_request(bytes);
  ASSERT_TRUE(request.has_value());
  EXPECT_EQ(request->id, 258U);
  EXPECT_EQ(request->sent_ms, 10U);
  EXPECT_EQ(request->method, "abc");
  EXPECT_EQ(request->message, "xyz");
}

TEST(LaneMessage, WithoutMethodIsAnEcho) {
  const auto request = parse_lane_request("\1\0\0\0\7\0\0\0\0\0"s);
  ASSERT_TRUE(request.has_value());
  EXPECT_TRUE(request->method.empty());
}

TEST(LaneMessage, IsRefusedWhereItIsNoneOfThisVersion) {
  EXPECT_FALSE(parse_lane_request(""));
  EXPECT_FALSE(parse_lane_request("\2\0\0\0\7\0\0\0\0\0"s)) << "another version";
  EXPECT_FALSE(parse_lane_request("\1\0\0\0\7\0\0\0\0"s)) << "half a head";
  EXPECT_FALSE(parse_lane_request("\1\0\0\0\7\0\0\0\0\4abc"s)) << "half a method";
  EXPECT_FALSE(parse_lane_request("\1\0\0\0\7\0\0\0\0\0"s + std::string(largest_lane_message, 'x')));
}

TEST(LaneMessage, AnswersAsThePageReadsThem) {
  EXPECT_EQ(lane_reply(LaneReply::echo, 258), "\3\0\0\1\2\0\0\0\0\0\0\0"s);
  EXPECT_EQ(lane_reply(LaneReply::answer, 1, {.code = 9, .message = "no", .details = "d"}, "xyz"),
            "\1\0\0\0\1\x09\0\2no\0\0\0\1dxyz"s);
}

TEST(LaneMessage, BoundsAMessageThatIsTooLongForItsField) {
  const auto bytes = lane_reply(LaneReply::refused, 1, {.code = 3, .message = std::string(70'000, 'm')});
  EXPECT_EQ(bytes.size(), 1U + 4 + 1 + 2 + 65'535 + 4);
}

}  // namespace
}  // namespace axisd::web
