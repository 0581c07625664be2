// What clients of one address may take of the main address.
#include "api/transport/peer_budgets.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <vector>

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using transport::PeerBudgets;
using Entry = PeerBudgets::Entry;

class PeerBudgetsTest : public ::testing::Test {
 protected:
  static TimePoint at(Duration since) { return TimePoint{} + 1h + since; }
  Entry enter(PeerBudgets::Id id, const std::string& address, Duration when = 0ms) {
    return budgets_.enter(id, address, at(when));
  }
  /// Each quarter of a second this connection sends and gets so much more; those that are cut off.
  std::vector<PeerBudgets::Id> run(PeerBudgets::Id id, std::uint64_t received, std::uint64_t sent,
                                   Duration time) {
    std::vector<PeerBudgets::Id> cut;
    for (const auto until = now_ + time; now_ < until && cut.empty();) {
      now_ += 250ms;
      traffic_[id].received += received;
      traffic_[id].sent += sent;
      cut = budgets_.count(traffic_, at(now_));
    }
    return cut;
  }

  PeerBudgets budgets_{
      {.connections = 8, .proportion = 4, .rate = 1000, .burst = 10'000, .longest_penalty = 20}};
  std::map<PeerBudgets::Id, PeerBudgets::Traffic> traffic_;
  Duration now_{};
};

TEST_F(PeerBudgetsTest, OneAddressLeavesPlacesToOthers) {
  for (PeerBudgets::Id id = 1; id <= 6; ++id) EXPECT_EQ(enter(id, "a"), Entry::granted);
  EXPECT_EQ(enter(7, "a"), Entry::address_full);
  EXPECT_EQ(enter(8, "b"), Entry::granted);
  EXPECT_EQ(enter(9, "c"), Entry::granted);
  EXPECT_EQ(enter(10, "d"), Entry::full);
  budgets_.leave(1);
  EXPECT_EQ(enter(11, "a"), Entry::granted);
  budgets_.leave(77);  // was never there
  EXPECT_EQ(budgets_.connections(), 8U);
}

TEST_F(PeerBudgetsTest, SilentConnectionsGiveWayToNewOnes) {
  for (PeerBudgets::Id id = 1; id <= 6; ++id) ASSERT_EQ(enter(id, "a", now_ += 1ms), Entry::granted);
  traffic_[1] = traffic_[3] = {.received = PeerBudgets::hello, .sent = 60};
  EXPECT_THAT(budgets_.count(traffic_, at(now_)), IsEmpty());
  ASSERT_EQ(enter(7, "a", now_), Entry::address_full);
  EXPECT_EQ(budgets_.gives_way("a", at(now_)), 2) << "the oldest that has not said hello";
  EXPECT_TRUE(budgets_.still_gives_way(2, {.received = 7, .sent = 60}, at(now_)));
  EXPECT_FALSE(budgets_.still_gives_way(2, {.received = 500, .sent = 60}, at(now_))) << "it has just done so";
  EXPECT_EQ(budgets_.gives_way("a", at(now_)), 4);
  budgets_.leave(4);
  EXPECT_EQ(enter(7, "a", now_), Entry::granted);
}

TEST_F(PeerBudgetsTest, IdleConnectionsGiveWayAndBusyOnesDoNot) {
  for (PeerBudgets::Id id = 1; id <= 6; ++id) {
    ASSERT_EQ(enter(id, "a"), Entry::granted);
    traffic_[id] = {.received = 200, .sent = 200};
  }
  ASSERT_THAT(budgets_.count(traffic_, at(now_)), IsEmpty());
  EXPECT_EQ(budgets_.gives_way("a", at(now_)), std::nullopt) << "all have just begun";
  // Keepalive is no activity, a call is.
  for (int i = 0; i < 40; ++i) {
    now_ += 250ms;
    for (PeerBudgets::Id id = 1; id <= 6; ++id) {
      const bool calls = id == 2 || (id == 1 && i < 10);
      traffic_[id].received += calls ? 80 : 39;
      traffic_[id].sent += calls ? 80 : 39;
    }
    ASSERT_THAT(budgets_.count(traffic_, at(now_)), IsEmpty());
  }
  std::vector<PeerBudgets::Id> left;
  while (const auto id = budgets_.gives_way("a", at(now_))) {
    left.push_back(*id);
    budgets_.leave(*id);
  }
  EXPECT_THAT(left, ElementsAre(3, 4, 5, 6, 1)) << "the one that was busy last goes last";
}

/// Each message is less than pings may be, and a count sees at most one.
TEST_F(PeerBudgetsTest, AStreamOfShortMessagesIsNotIdle) {
  for (PeerBudgets::Id id = 1; id <= 2; ++id) {
    ASSERT_EQ(enter(id, "a"), Entry::granted);
    traffic_[id] = {.received = 200, .sent = 200};
  }
  for (int i = 0; i < 200; ++i) {
    now_ += 50ms;
    if (i % 2 == 0) traffic_[1].sent += 60;
    if (i % 20 == 0) traffic_[2].sent += 78;  // keepalive
    ASSERT_THAT(budgets_.count(traffic_, at(now_)), IsEmpty());
  }
  EXPECT_EQ(budgets_.gives_way("a", at(now_)), 2);
  budgets_.leave(2);
  EXPECT_EQ(budgets_.gives_way("a", at(now_)), std::nullopt);
}

TEST_F(PeerBudgetsTest, WhereAllPlacesAreTakenTheAddressWithMostGivesWay) {
  for (PeerBudgets::Id id = 1; id <= 5; ++id) ASSERT_EQ(enter(id, "a", now_ += 1ms), Entry::granted);
  for (PeerBudgets::Id id = 6; id <= 8; ++id) ASSERT_EQ(enter(id, "b", 0ms), Entry::granted);
  ASSERT_EQ(enter(9, "c", now_), Entry::full);
  EXPECT_EQ(budgets_.gives_way("c", at(now_)), 1);
}

TEST_F(PeerBudgetsTest, WhoseTrafficIsNotCountedStays) {
  for (PeerBudgets::Id id = 1; id <= 6; ++id)
    ASSERT_EQ(budgets_.enter(id, "anna", at(0ms), false), Entry::granted);
  EXPECT_EQ(budgets_.gives_way("anna", at(1h)), std::nullopt);
}

TEST_F(PeerBudgetsTest, WhoGetsAnswersMaySendWhatHeLikes) {
  ASSERT_EQ(enter(1, "a"), Entry::granted);
  EXPECT_THAT(run(1, 1'000'000, 250'000, 60s), IsEmpty());
}

TEST_F(PeerBudgetsTest, AnAnswerThatComesLaterCounts) {
  ASSERT_EQ(enter(1, "a"), Entry::granted);
  for (int i = 0; i < 100; ++i) {
    ASSERT_THAT(run(1, 8000, 0, 250ms), IsEmpty()) << i;
    ASSERT_THAT(run(1, 0, 2000, 8s), IsEmpty()) << i;
  }
}

TEST_F(PeerBudgetsTest, ALongMessageNowAndThenIsNoFlood) {
  ASSERT_EQ(enter(1, "a"), Entry::granted);
  for (int i = 0; i < 20; ++i) {
    EXPECT_THAT(run(1, 9000, 10, 250ms), IsEmpty());
    EXPECT_THAT(run(1, 0, 0, 10s), IsEmpty());
  }
}

TEST_F(PeerBudgetsTest, AFloodIsCutOffAndKeptOutForAWhile) {
  ASSERT_EQ(enter(1, "a"), Entry::granted);
  ASSERT_EQ(enter(2, "a"), Entry::granted);
  ASSERT_EQ(enter(3, "b"), Entry::granted);
  traffic_[2] = {.received = 900, .sent = 300};
  traffic_[3] = {.received = 900, .sent = 300};
  EXPECT_THAT(run(1, 20'000, 100, 10s), ElementsAre(1));
  budgets_.leave(1);
  traffic_.erase(1);
  EXPECT_EQ(enter(4, "a", now_), Entry::address_floods);
  EXPECT_EQ(enter(5, "b", now_), Entry::granted);
  EXPECT_THAT(run(2, 900, 300, 15s), IsEmpty()) << "of the same address, and honest";
  EXPECT_EQ(enter(6, "a", now_), Entry::granted) << "its bucket is half empty again";
}

TEST_F(PeerBudgetsTest, NobodyElseIsToBlameForAFlood) {
  ASSERT_EQ(enter(1, "a"), Entry::granted);
  ASSERT_EQ(enter(2, "a"), Entry::granted);
  traffic_[2] = {.received = 300, .sent = 300};
  EXPECT_THAT(run(1, 1'000'000, 0, 1s), ElementsAre(1));
  budgets_.leave(1);
  traffic_.erase(1);
  // A long request, in the midst of the penalty, and its answer is not there yet.
  EXPECT_THAT(run(2, 4000, 0, 250ms), IsEmpty());
  EXPECT_THAT(run(2, 0, 3000, 1s), IsEmpty());
}

TEST_F(PeerBudgetsTest, NobodyIsKeptOutLongerThanThePenalty) {
  ASSERT_EQ(enter(1, "a"), Entry::granted);
  EXPECT_THAT(run(1, 1'000'000'000, 0, 1s), ElementsAre(1));
  budgets_.leave(1);
  EXPECT_EQ(enter(2, "a", now_ + 14s), Entry::address_floods);
  EXPECT_EQ(enter(2, "a", now_ + 15s), Entry::granted);
}

TEST_F(PeerBudgetsTest, WhoeverIsBlamedIsTreatedAsAfterAFlood) {
  ASSERT_EQ(enter(1, "a"), Entry::granted);
  budgets_.blame(1, at(now_));
  budgets_.leave(1);
  budgets_.blame(1, at(now_));  // is gone
  EXPECT_EQ(enter(2, "a", now_ + 4s), Entry::address_floods);
  EXPECT_EQ(enter(2, "b", now_ + 4s), Entry::granted);
  EXPECT_EQ(enter(3, "a", now_ + 6s), Entry::granted);
}

TEST_F(PeerBudgetsTest, ManyThatFloodALittleAreCutOffTogether) {
  for (PeerBudgets::Id id = 1; id <= 6; ++id) ASSERT_EQ(enter(id, "a"), Entry::granted);
  std::vector<PeerBudgets::Id> cut;
  for (int i = 0; i < 100 && cut.empty(); ++i) {
    now_ += 250ms;
    for (PeerBudgets::Id id = 1; id <= 6; ++id) traffic_[id].received += 600;
    cut = budgets_.count(traffic_, at(now_));
  }
  EXPECT_FALSE(cut.empty());
}

TEST_F(PeerBudgetsTest, TheMostOneSidedIsKnownHoweverSlowItIs) {
  for (PeerBudgets::Id id = 1; id <= 3; ++id) ASSERT_EQ(enter(id, "a"), Entry::granted);
  for (int i = 0; i < 4000; ++i) {
    now_ += 250ms;
    traffic_[1].received += 200, traffic_[1].sent += 100;
    traffic_[2].received += 40;
    traffic_[3].received += 30;
    ASSERT_THAT(budgets_.count(traffic_, at(now_)), IsEmpty()) << i;
  }
  EXPECT_EQ(budgets_.most_one_sided(), 2);
  budgets_.leave(2);
  EXPECT_EQ(budgets_.most_one_sided(), std::nullopt) << "so little is nobody's fault";
}

TEST_F(PeerBudgetsTest, AnAddressIsForgottenWhenItIsGone) {
  ASSERT_EQ(enter(1, "a"), Entry::granted);
  ASSERT_THAT(run(1, 20'000, 0, 1s), ElementsAre(1));
  budgets_.leave(1);
  ASSERT_EQ(enter(2, "b", now_), Entry::granted);
  EXPECT_EQ(budgets_.addresses(), 2U);
  budgets_.leave(2);
  ASSERT_EQ(enter(3, "c", now_ + 60s), Entry::granted);
  EXPECT_EQ(budgets_.addresses(), 1U);
}

}  // namespace
}  // namespace axisd::testing
