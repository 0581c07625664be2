// What gRPC's channelz tells, as JSON.
#include "api/transport/stream_counts.hpp"

#include <gmock/gmock.h>

namespace axisd::testing {
namespace {

using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;
using transport::sockets_in;
using transport::streams_in;

TEST(StreamCounts, WhatIsLeftOutIsNone) {
  const auto all = streams_in(
      R"({"socket":{"data":{"streamsFailed":"2","streamsStarted":"9","streamsSucceeded":"4"},"ref":{"socketId":"7"}}})");
  ASSERT_TRUE(all);
  EXPECT_EQ(all->started, 9);
  EXPECT_EQ(all->ended, 6);
  EXPECT_EQ(all->open(), 3);
  const auto none = streams_in(R"({"socket":{"data":{},"ref":{"socketId":"7"}}})");
  ASSERT_TRUE(none);
  EXPECT_EQ(none->open(), 0);
}

TEST(StreamCounts, WhatCannotBeReadIsNotKnown) {
  EXPECT_FALSE(streams_in(""));
  EXPECT_FALSE(streams_in("{}"));
  const auto odd = streams_in(R"({"socket":{"data":{"streamsStarted":"x)");
  ASSERT_TRUE(odd);
  EXPECT_EQ(odd->open(), 0);
}

TEST(StreamCounts, PagesGoOnWhereTheLastOneEnded) {
  std::map<std::string, std::int64_t> to;
  const auto next = sockets_in(
      R"({"socketRef":[{"name":"chttp2 ipv4:127.0.0.1:1","socketId":"12"},{"name":"x","socketId":"13"},)"
      R"({"name":"chttp2 ipv6:%5B::1%5D:2","socketId":"15"}]})",
      0, to);
  EXPECT_EQ(next, 16);
  EXPECT_THAT(to, UnorderedElementsAre(Pair("ipv4:127.0.0.1:1", 12), Pair("ipv6:%5B::1%5D:2", 15)));
  EXPECT_EQ(sockets_in(R"({"socketRef":[{"name":"chttp2 ipv4:127.0.0.1:1","socketId":"20"}]})", 16, to), 21);
  EXPECT_EQ(to.at("ipv4:127.0.0.1:1"), 20) << "the newer one";
  EXPECT_EQ(sockets_in(R"({"end":true})", 21, to), std::nullopt);
}

TEST(StreamCounts, PagesThatCannotBeReadAreTheLast) {
  std::map<std::string, std::int64_t> to;
  for (const auto* page :
       {"", "{}", R"({"socketRef":[{"name":"chttp2 a","socketId":"x"}]})",
        R"({"socketRef":[{"name":"chttp2 a"}]})", R"({"socketRef":[{"name":"chttp2 a","socketId":"4"}]})",
        R"({"socketRef":[{"name":"chttp2 a)"})
    EXPECT_EQ(sockets_in(page, 5, to), std::nullopt) << page;
  EXPECT_THAT(to, IsEmpty());
}

}  // namespace
}  // namespace axisd::testing
