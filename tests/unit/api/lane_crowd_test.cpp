// Who goes of a crowd that says nothing.
#include <gtest/gtest.h>

#include <string>

#include "api/server/lane/crowd.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using server::lane::Crowd;

class LaneCrowd : public ::testing::Test {
 protected:
  TimePoint at(Duration since) { return TimePoint{} + since; }
  /// The next connection, from there; who goes for it.
  std::optional<Crowd::Id> come(const std::string& address, const std::string& network) {
    const auto leaves = crowd_.enter(++last_, {.address = address, .network = network}, at(last_ * 1ms));
    if (leaves) crowd_.leave(*leaves);
    return leaves;
  }
  std::optional<Crowd::Id> come(const std::string& address) { return come(address, address); }

  Crowd crowd_{{.most = 100, .patience = 3s}};
  Crowd::Id last_ = 0;
};

TEST_F(LaneCrowd, WhoeverComesHasTimeForAHundredOthers) {
  for (int i = 0; i < 250; ++i) come("a");
  const auto operators = last_ + 1;
  for (int i = 0; i < 100; ++i) EXPECT_NE(come("a"), operators) << i;
  EXPECT_EQ(come("a"), operators);
  EXPECT_EQ(crowd_.size(), 100U);
}

TEST_F(LaneCrowd, WhoFloodsTakesThePlacesOfNoOtherAddress) {
  come("operator");
  for (int i = 0; i < 1000; ++i) EXPECT_NE(come("flood"), 1U);
  come("panel");
  for (int i = 0; i < 1000; ++i) EXPECT_GT(come("flood").value_or(1000), 1U);
  EXPECT_EQ(crowd_.size(), 100U);
}

/// As in an IPv6 network, whose computers have as many addresses as they like.
TEST_F(LaneCrowd, NorDoesANetworkOfManyAddresses) {
  come("10.0.0.1");
  for (int i = 0; i < 1000; ++i) EXPECT_NE(come("n::" + std::to_string(i), "n"), 1U);
}

TEST_F(LaneCrowd, InANetworkTheAddressWithMostMakesRoom) {
  come("n::1", "n");
  for (int i = 0; i < 1000; ++i) EXPECT_NE(come("n::2", "n"), 1U);
}

TEST_F(LaneCrowd, OfManyNetworksWithOneEachTheOldestGoes) {
  for (int i = 100; i > 0; --i) EXPECT_FALSE(come(std::to_string(i)));
  for (Crowd::Id oldest = 1; oldest <= 100; ++oldest) EXPECT_EQ(come("x" + std::to_string(oldest)), oldest);
}

TEST_F(LaneCrowd, TheSilentHaveTheirTime) {
  EXPECT_EQ(crowd_.next_due(), TimePoint::max());
  EXPECT_EQ(crowd_.least_needed(), std::nullopt);
  come("a"), come("b");
  EXPECT_EQ(crowd_.next_due(), at(3001ms));
  EXPECT_FALSE(crowd_.overdue(at(3000ms)));
  EXPECT_EQ(crowd_.overdue(at(3001ms)), 1U);
  crowd_.leave(1);
  crowd_.leave(1);  // is gone already
  EXPECT_EQ(crowd_.overdue(at(3002ms)), 2U);
  EXPECT_EQ(crowd_.least_needed(), 2U);
}

}  // namespace
}  // namespace axisd::testing
