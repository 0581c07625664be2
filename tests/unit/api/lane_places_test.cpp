// Who keeps a connection to the stop lane.
#include <gtest/gtest.h>

#include <string>

#include "api/server/lane/places.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using server::lane::Places;

constexpr Places::Limits limits{.connections = 8,
                                .strangers = 4,
                                .strangers_per_address = 2,
                                .per_identity = 3,
                                .local = 5,
                                .introduction = 3s};

class StopPlaces : public ::testing::Test {
 protected:
  TimePoint at(Duration since) { return TimePoint{} + since; }
  /// Of a client that identifies itself at once; what had to go for it.
  std::vector<Places::Id> come(Places::Id id, const std::string& identity, Duration when) {
    std::vector<Places::Id> gone;
    const auto leave = [&](std::optional<Places::Id> each) {
      if (!each) return;
      gone.push_back(*each);
      places_.leave(*each);
    };
    leave(places_.enter(id, {"10.0.0.9", "10.0.0.9"}, at(when)));
    leave(places_.identify(id, identity, false, at(when)));
    return gone;
  }

  Places places_{limits};
};

TEST_F(StopPlaces, StrangersOfOneAddressTakeEachOthersPlace) {
  EXPECT_FALSE(places_.enter(1, {"a", "a"}, at(1ms)));
  EXPECT_FALSE(places_.enter(2, {"a", "a"}, at(2ms)));
  EXPECT_EQ(places_.enter(3, {"a", "a"}, at(3ms)), 1U);
}

TEST_F(StopPlaces, AStrangerInMidHandshakeGoesAfterSilentOnes) {
  EXPECT_FALSE(places_.enter(1, {"a", "a"}, at(1ms)));
  places_.greeted(1);
  EXPECT_FALSE(places_.enter(2, {"a", "a"}, at(3ms)));
  for (Places::Id id = 3; id <= 9; ++id) {
    EXPECT_EQ(places_.enter(id, {"a", "a"}, at(id * 1ms)), id - 1)
        << "whoever is about to say who it is stays";
    places_.leave(id - 1);
  }
  EXPECT_EQ(places_.overdue(at(3001ms)), 1U) << "not for ever";
}

TEST_F(StopPlaces, StrangersInAllTakeThatOfTheNetworkWithMost) {
  for (Places::Id id = 1; id <= 2; ++id) EXPECT_FALSE(places_.enter(id, {"a", "a"}, at(id * 1ms)));
  EXPECT_FALSE(places_.enter(3, {"b", "b"}, at(3ms)));
  EXPECT_FALSE(places_.enter(4, {"c", "c"}, at(4ms)));
  EXPECT_EQ(places_.enter(5, {"d", "d"}, at(5ms)), 1U);
}

/// As in an IPv6 network: one computer has as many addresses as it likes, and others of its network have one.
TEST_F(StopPlaces, AnAddressHasAShareOfItsOwnInItsNetwork) {
  for (Places::Id id = 1; id <= 2; ++id) EXPECT_FALSE(places_.enter(id, {"n::1", "n"}, at(id * 1ms)));
  EXPECT_FALSE(places_.enter(3, {"n::2", "n"}, at(3ms))) << "that of a neighbour is none of its business";
  EXPECT_EQ(places_.enter(4, {"n::1", "n"}, at(4ms)), 1U) << "nor does it take the neighbour's";
}

TEST_F(StopPlaces, ManyAddressesOfANetworkPushOutNoOtherOne) {
  EXPECT_FALSE(places_.enter(1, {"10.0.0.1", "10.0.0.1"}, at(1ms)));
  for (Places::Id id = 2; id <= 4; ++id)
    EXPECT_FALSE(places_.enter(id, {"n::" + std::to_string(id), "n"}, at(id * 1ms)));
  for (Places::Id id = 5; id <= 9; ++id) {
    EXPECT_EQ(places_.enter(id, {"n::" + std::to_string(id), "n"}, at(id * 1ms)), id - 3);
    places_.leave(id - 3);
  }
}

TEST_F(StopPlaces, AStrangerHasItsTime) {
  EXPECT_EQ(places_.next_due(), TimePoint::max());
  EXPECT_FALSE(places_.enter(1, {"a", "a"}, at(0s)));
  EXPECT_FALSE(places_.enter(2, {"b", "b"}, at(1s)));
  EXPECT_EQ(places_.next_due(), at(3s));
  EXPECT_FALSE(places_.overdue(at(2999ms)));
  EXPECT_EQ(places_.overdue(at(3s)), 1U);
  EXPECT_FALSE(places_.identify(1, "hmi", false, at(3s)));
  EXPECT_FALSE(places_.overdue(at(3s)));
  EXPECT_EQ(places_.overdue(at(4s)), 2U);
}

TEST_F(StopPlaces, AnIdentityBeyondItsShareLosesItsIdlest) {
  EXPECT_TRUE(come(1, "hmi", 1ms).empty());
  EXPECT_TRUE(come(2, "hmi", 2ms).empty());
  EXPECT_TRUE(come(3, "hmi", 3ms).empty());
  places_.used(1, at(10ms), 0);
  EXPECT_EQ(come(4, "hmi", 11ms), std::vector<Places::Id>{2});
}

TEST_F(StopPlaces, WhoWaitsForAnAnswerGoesLast) {
  for (Places::Id id = 1; id <= 3; ++id) come(id, "hmi", id * 1ms);
  places_.used(1, at(4ms), 1);
  places_.used(2, at(5ms), 0);
  places_.used(3, at(6ms), 0);
  EXPECT_EQ(come(4, "hmi", 7ms), std::vector<Places::Id>{2});
}

TEST_F(StopPlaces, WhoNeverAskedGoesBeforeWhoDid) {
  for (Places::Id id = 1; id <= 3; ++id) come(id, "hmi", id * 1ms);
  places_.asked(1);
  places_.asked(2);
  EXPECT_EQ(come(4, "hmi", 7ms), std::vector<Places::Id>{3});
  EXPECT_EQ(come(5, "hmi", 8ms), std::vector<Places::Id>{4});
}

TEST_F(StopPlaces, AComputersOwnClientsShareMore) {
  for (Places::Id id = 1; id <= 5; ++id) {
    EXPECT_FALSE(places_.enter(id, {"localhost", "localhost"}, at(id * 1ms)));
    EXPECT_FALSE(places_.identify(id, "local:localhost", true, at(id * 1ms)));
  }
  EXPECT_FALSE(places_.enter(6, {"localhost", "localhost"}, at(6ms)));
  EXPECT_EQ(places_.identify(6, "local:localhost", true, at(6ms)), 1U);
}

TEST_F(StopPlaces, NobodyTakesAnothersPlaceByOpeningMany) {
  come(1, "panel", 1ms);
  come(2, "cell", 2ms);
  Places::Id next = 3;
  for (const auto* crowd : {"x", "y"})
    for (int i = 0; i < 3; ++i, ++next) EXPECT_TRUE(come(next, crowd, next * 1ms).empty()) << next;
  ASSERT_EQ(places_.size(), 8U);
  // All of them newer than panel's and cell's.
  for (int i = 0; i < 20; ++i, ++next)
    for (const auto gone : come(next, i % 2 == 0 ? "x" : "y", next * 1ms)) {
      EXPECT_NE(gone, 1U);
      EXPECT_NE(gone, 2U);
    }
  // Nor does a new one.
  for (const auto gone : come(next, "operator", next * 1ms)) EXPECT_GT(gone, 2U);
}

}  // namespace
}  // namespace axisd::testing
