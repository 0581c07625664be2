#include "devices/axis/stop_holds.hpp"

#include <gmock/gmock.h>

#include <string>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using Whose = HoldRelease::Whose;

const WallTime noon{12h};

StopHold hold(StopHolds& holds, const std::string& holder, const std::string& request = {},
              TimePoint arrived = TimePoint(1s)) {
  return holds.add({.holder = holder, .request_id = request}, noon, arrived);
}

void release(StopHolds& holds, const HoldRelease& which) {
  for (const auto& meant : holds.meant_by(which)) EXPECT_TRUE(holds.end(meant));
}

TEST(StopHolds, EachHolderAndRequestCounts) {
  StopHolds holds;
  EXPECT_TRUE(holds.empty());
  hold(holds, "hmi", "r1");
  hold(holds, "hmi", "r2");
  hold(holds, "hmi");
  hold(holds, "panel");
  EXPECT_EQ(holds.all().size(), 4U);
  release(holds, {.client = "hmi"});
  EXPECT_EQ(holds.all().size(), 3U) << "without a name only the one without a name";
  release(holds, {.client = "panel", .request_id = "r1"});
  EXPECT_EQ(holds.all().size(), 3U) << "it is the other client's";
  release(holds, {.client = "hmi", .request_id = "r1"});
  EXPECT_EQ(holds.all().size(), 2U);
  release(holds, {.client = "hmi", .whose = Whose::mine});
  ASSERT_EQ(holds.all().size(), 1U);
  EXPECT_EQ(holds.all().front().key.holder, "panel");
  hold(holds, "hmi", "r3");
  release(holds, {.client = "engineer", .whose = Whose::everybody});
  EXPECT_TRUE(holds.empty());
}

TEST(StopHolds, TheSameRequestIsOneHold) {
  StopHolds holds;
  hold(holds, "hmi", "r1");
  holds.add({.holder = "hmi", .request_id = "r1"}, noon + 1h, TimePoint(2s));
  hold(holds, "hmi");
  hold(holds, "hmi");
  ASSERT_EQ(holds.all().size(), 2U);
  EXPECT_EQ(holds.all().at(1).since, noon) << "since the first";
}

TEST(StopHolds, WhatIsBeyondAClientsShareIsOneHoldOfItsOwn) {
  StopHolds holds;
  for (int i = 0; i < 1000; ++i) hold(holds, "flood", "r" + std::to_string(i));
  EXPECT_EQ(holds.all().size(), StopHolds::share + 1);
  hold(holds, "flood");
  EXPECT_EQ(holds.all().size(), StopHolds::share + 2) << "that without a name has its place";
  EXPECT_EQ(hold(holds, "hmi", "r1").key.request_id, "r1") << "nobody else is concerned";
  for (int i = 0; i < 1000; ++i) release(holds, {.client = "flood", .request_id = "r" + std::to_string(i)});
  release(holds, {.client = "flood"});
  ASSERT_EQ(holds.all().size(), 2U) << "names that are not kept apart release nothing";
  EXPECT_EQ(holds.all().front().key.request_id, StopHolds::more_requests);
  EXPECT_THAT(how_to_release({holds.all().front()}, "feeder", "flood"), HasSubstr("--mine"));
  release(holds, {.client = "flood", .whose = Whose::mine});
  ASSERT_EQ(holds.all().size(), 1U);
  EXPECT_EQ(holds.all().front().key.holder, "hmi");
}

TEST(StopHolds, AnyNumberOfClientsHolds) {
  StopHolds holds;
  for (std::size_t i = 0; i < 3 * StopHolds::holders; ++i) hold(holds, "client" + std::to_string(i), "r");
  EXPECT_EQ(holds.all().size(), StopHolds::holders + 1);
  for (std::size_t i = 0; i < 3 * StopHolds::holders; ++i)
    release(holds, {.client = "client" + std::to_string(i), .whose = Whose::mine});
  ASSERT_EQ(holds.all().size(), 1U) << "who is not kept apart is not released with another";
  EXPECT_EQ(holds.all().front().key.holder, StopHolds::more_clients);
  release(holds, {.client = "hmi", .whose = Whose::everybody});
  EXPECT_TRUE(holds.empty());
}

TEST(StopHolds, AStopThatArrivedAfterTheReleaseIsNotMeant) {
  StopHolds holds;
  hold(holds, "hmi", "r1", TimePoint(5s));
  hold(holds, "hmi", "r1", TimePoint(4s));
  for (const auto whose : {Whose::one, Whose::mine, Whose::everybody}) {
    EXPECT_TRUE(
        holds.meant_by({.client = "hmi", .request_id = "r1", .whose = whose, .arrived = TimePoint(4s)})
            .empty());
    EXPECT_EQ(holds.meant_by({.client = "hmi", .request_id = "r1", .whose = whose, .arrived = TimePoint(5s)})
                  .size(),
              1U);
  }
}

TEST(StopHolds, AHoldThatWasRenewedWhileItWasReleasedStands) {
  StopHolds holds;
  const auto read = hold(holds, "hmi");
  hold(holds, "hmi");
  EXPECT_FALSE(holds.end(read));
  EXPECT_FALSE(holds.empty());
  EXPECT_TRUE(holds.end(holds.all().front()));
  EXPECT_TRUE(holds.end(read)) << "it has ended already";
}

TEST(StopHolds, WhetherAHoldIsDurableIsKnown) {
  StopHolds holds;
  holds.restore({.holder = "panel", .request_id = {}}, noon);
  EXPECT_TRUE(holds.all().front().durable);
  const auto key = hold(holds, "hmi").key;
  EXPECT_FALSE(holds.all().front().durable);
  EXPECT_TRUE(holds.set_durable(key, true));
  EXPECT_FALSE(holds.set_durable(key, true)) << "no news";
  EXPECT_TRUE(holds.all().front().durable);
  EXPECT_FALSE(holds.set_durable({.holder = "nobody", .request_id = {}}, true));
}

TEST(StopHolds, TextsNameHoldersAndWhatToDo) {
  StopHolds holds;
  hold(holds, "hmi", "r1");
  EXPECT_EQ(text_of(holds.all()), "hmi (request r1) since 1970-01-01T12:00:00Z");
  EXPECT_EQ(how_to_release(holds.all(), "feeder", "hmi"),
            "release it: axisctl release-stop feeder --request-id r1");
  EXPECT_THAT(how_to_release(holds.all(), "feeder", "panel"), HasSubstr("release-stop feeder --everybody"));
  hold(holds, "hmi");
  EXPECT_THAT(text_of(holds.all()), HasSubstr("hmi since 1970-01-01T12:00:00Z, hmi (request r1)"));
  EXPECT_THAT(how_to_release(holds.all(), "feeder", "hmi"), HasSubstr("release-stop feeder --mine"));
  StopHolds unnamed;
  hold(unnamed, "hmi");
  EXPECT_EQ(how_to_release(unnamed.all(), "feeder", "hmi"), "release it: axisctl release-stop feeder");
  for (int i = 0; i < 12; ++i) hold(unnamed, "hmi", "r" + std::to_string(i));
  EXPECT_THAT(text_of(unnamed.all()), HasSubstr("and 5 more"));
}

}  // namespace
}  // namespace axisd
