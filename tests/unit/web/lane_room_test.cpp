#include "api/web/gateway/lane_room.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "api/server/lane/http2.hpp"

namespace axisd::web {
namespace {

using namespace std::chrono_literals;
using server::lane::Http2;

constexpr TimePoint start{Duration(1h)};

/// What the daemon counts for a call (api/server/lane/http2.cpp): frames of headers, data, a ping and what
/// acknowledges its answers; bytes; headers after decompression.
double daemons_cost(std::size_t size) {
  constexpr double frames = 1 + 1 + 1 + 2;
  constexpr double bytes = 5 * 9 + 80;  // heads of frames, and headers as they usually come
  // :method, :scheme, :path, :authority, content-type, te, user-agent, grpc-accept-encoding, grpc-timeout,
  // axisd-user, axisd-role: each 32 and its text.
  constexpr double headers = 11 * 32 + 12 + 12 + 40 + 30 + 28 + 10 + 50 + 42 + 17 + 40 + 20;
  return frames + (bytes + static_cast<double>(size)) / 128 + headers / 128;
}

TEST(LaneRoom, StaysBelowWhatTheDaemonTakesOfAConnection) {
  EXPECT_LT(LaneRoom::most_moves + LaneRoom::most_stops, Http2::most_streams);
  EXPECT_LE(LaneRoom::effort.at_once, 0.75 * Http2::effort_at_once);
  EXPECT_LE(LaneRoom::effort.per_second, 0.75 * Http2::effort_per_second);
  EXPECT_LT(LaneRoom::largest, Http2::largest_message);
  for (const std::size_t size : {0U, 100U, 512U, 1024U})
    EXPECT_GE(LaneRoom::cost_of(size), daemons_cost(size)) << size;
}

TEST(LaneRoom, StopsTakeNoPlaceOfAPress) {
  LaneRoom room;
  std::vector<LaneRoom::Place> places;
  for (const auto* who : {"a", "b", "c"})
    for (int i = 0; i < 100; ++i)
      if (auto place = room.stop(who, 50, start)) places.push_back(*std::move(place));
  EXPECT_EQ(std::ssize(places), LaneRoom::most_stops);
  EXPECT_TRUE(room.move("d", 50, start));
  EXPECT_FALSE(room.stop("d", 50, start)) << "it goes to the main address";
  places.pop_back();
  EXPECT_TRUE(room.stop("d", 50, start));
}

TEST(LaneRoom, PressesHaveASharePerPerson) {
  LaneRoom room;
  std::vector<LaneRoom::Place> places;
  for (int i = 0; i < LaneRoom::most_moves_each; ++i) places.push_back(room.move("a", 50, start).value());
  EXPECT_FALSE(room.move("a", 50, start));
  EXPECT_TRUE(room.move("b", 50, start));
}

TEST(LaneRoom, PressesLeaveEffortForStops) {
  LaneRoom room;
  TimePoint now = start;
  int presses = 0, stops = 0;
  for (int i = 0; i < 10'000; ++i) presses += room.move(std::to_string(i % 50), 100, now).has_value() ? 1 : 0;
  EXPECT_NEAR(presses * LaneRoom::cost_of(100), LaneRoom::effort.at_once - LaneRoom::kept_for_stops,
              LaneRoom::cost_of(100));
  for (int i = 0; i < 10'000; ++i) stops += room.stop(std::to_string(i % 50), 100, now).has_value() ? 1 : 0;
  EXPECT_NEAR(stops * LaneRoom::cost_of(100), LaneRoom::kept_for_stops, LaneRoom::cost_of(100));
  now += 1s;
  EXPECT_TRUE(room.move("a", 100, now));
}

TEST(LaneRoom, WhoHoldsFiveButtonsIsServed) {
  LaneRoom room;
  TimePoint now = start;
  for (int i = 0; i < 6000; ++i, now += 20ms) ASSERT_TRUE(room.move("a", 120, now)) << i;
}

TEST(LaneRoom, WhatIsLargeGoesAnotherWay) {
  LaneRoom room;
  EXPECT_TRUE(room.stop("a", LaneRoom::largest, start));
  EXPECT_FALSE(room.stop("a", LaneRoom::largest + 1, start));
  EXPECT_FALSE(room.move("a", LaneRoom::largest + 1, start));
}

}  // namespace
}  // namespace axisd::web
