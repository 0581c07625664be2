// Whom gRPC is asked about, and whose streams are too many.
#include "api/transport/stream_budget.hpp"

#include <gmock/gmock.h>

#include <set>

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using transport::StreamBudget;
using Id = StreamBudget::Id;

/// Connections as gRPC would have them.
class StreamBudgetTest : public ::testing::Test {
 protected:
  struct Peer {
    std::string address;
    StreamBudget::Seen has{};
    std::uint64_t bytes = 0;
  };
  void enter(Id id, const std::string& address) {
    peers_[id] = {.address = address};
    budget_.enter(id, address);
  }
  /// It begins that many streams, of which so many are calls in progress.
  void begin(Id id, int streams, int in_progress = 0) {
    auto& peer = peers_.at(id);
    peer.has.started += streams;
    peer.has.in_progress += in_progress;
    peer.bytes += static_cast<std::uint64_t>(streams) * StreamBudget::least_bytes;
    budget_.received(id, peer.bytes);
  }
  void end(Id id, int streams) { peers_.at(id).has.ended += streams; }
  /// Asks about all in doubt, until nothing is new, and later once more. Whom to cut off then.
  std::vector<Id> look(Duration later = StreamBudget::lasts_for) {
    for (const auto end = now_ + later; now_ <= end; now_ += 10ms) {
      const auto asked = budget_.doubtful(now_);
      looks_ += asked.size();
      for (const auto id : asked) budget_.seen(id, peers_.at(id).has, 0, now_);
      if (auto cut = budget_.beyond(now_); !cut.empty()) return cut;
    }
    return {};
  }

  std::map<Id, Peer> peers_;
  TimePoint now_ = TimePoint{} + 1h;
  std::size_t looks_ = 0;
  StreamBudget budget_{{.of_one = 100, .lasting = 200, .idle = 400}};
};

TEST_F(StreamBudgetTest, NobodyIsAskedAboutWhereAllAreFew) {
  for (Id id = 1; id <= 192; ++id) {
    enter(id, "a");
    begin(id, 1);
  }
  EXPECT_THAT(look(10s), IsEmpty());
  EXPECT_EQ(looks_, 0);
}

TEST_F(StreamBudgetTest, HowFarItMayBeOffDecidesWhoIsAskedAbout) {
  for (Id id = 1; id <= 100; ++id) {
    enter(id, "a");
    begin(id, 2);
  }
  EXPECT_THAT(budget_.doubtful(now_), IsEmpty());
  begin(7, 20);
  auto asked = budget_.doubtful(now_);
  EXPECT_THAT(asked, SizeIs(18)) << "some, and one for each 64 that may have begun";
  EXPECT_EQ(asked.front(), 7);
  peers_.at(7).has = {.started = 22, .ended = 22};
  budget_.seen(7, peers_.at(7).has, 0, now_);
  EXPECT_THAT(budget_.doubtful(now_), IsEmpty()) << "they have ended";
}

TEST_F(StreamBudgetTest, WhatGrpcHasNotReadYetIsStillInDoubt) {
  enter(1, "a");
  begin(1, 300);
  ASSERT_THAT(budget_.doubtful(now_), ElementsAre(1));
  budget_.seen(1, {}, 2500, now_);
  EXPECT_THAT(budget_.doubtful(now_), ElementsAre(1));
  budget_.seen(1, {}, 2000, now_);
  EXPECT_THAT(budget_.doubtful(now_), ElementsAre(1)) << "200, more than one may have";
  budget_.seen(1, {}, 1000, now_);
  EXPECT_THAT(budget_.doubtful(now_), IsEmpty());
}

TEST_F(StreamBudgetTest, WhatGrpcIsInTheMidstOfIsLookedForOnceMore) {
  enter(1, "a");
  begin(1, 300);
  budget_.seen(1, {.started = 3}, 0, now_);
  EXPECT_THAT(budget_.doubtful(now_), IsEmpty());
  now_ += StreamBudget::taken_in_after / 2;
  budget_.seen(1, {.started = 4}, 0, now_);
  now_ += StreamBudget::taken_in_after;
  EXPECT_THAT(budget_.doubtful(now_ - 1ms), IsEmpty());
  EXPECT_THAT(budget_.doubtful(now_), ElementsAre(1));
  budget_.seen(1, {.started = 5}, 0, now_);
  EXPECT_THAT(budget_.doubtful(now_ + 1h), IsEmpty());
}

TEST_F(StreamBudgetTest, WhoSendsNothingAnyMoreIsAskedAboutInItsTurn) {
  for (Id id = 1; id <= 60; ++id) {
    enter(id, "a");
    begin(id, 4);
  }
  std::set<Id> asked;
  for (int i = 0; i < 20; ++i, now_ += 10ms)
    for (const auto id : budget_.doubtful(now_)) {
      asked.insert(id);
      budget_.seen(id, peers_.at(id).has, 0, now_);
      begin(1 + id % 30, 10);  // others are busy
      end(1 + id % 30, 10);
    }
  EXPECT_THAT(asked, SizeIs(60));
}

TEST_F(StreamBudgetTest, OneHasNoMoreThanItsShareAtTwoLooks) {
  enter(1, "a");
  begin(1, 101, 101);
  ASSERT_THAT(budget_.doubtful(now_), ElementsAre(1));
  budget_.seen(1, peers_.at(1).has, 0, now_);
  EXPECT_THAT(budget_.beyond(now_), IsEmpty()) << "they may be about to end";
  now_ += 10ms;
  ASSERT_THAT(budget_.doubtful(now_), ElementsAre(1)) << "it is looked at again";
  budget_.seen(1, {.started = 101, .ended = 1, .in_progress = 100}, 0, now_);
  EXPECT_THAT(budget_.beyond(now_), IsEmpty());
  for (int i = 0; i < 2; ++i) budget_.seen(1, peers_.at(1).has, 0, now_);
  EXPECT_THAT(budget_.beyond(now_), ElementsAre(1));
}

TEST_F(StreamBudgetTest, TwiceItsShareIsTooManyAtOnce) {
  enter(1, "a");
  begin(1, 201, 201);
  EXPECT_THAT(look(0ms), ElementsAre(1));
}

TEST_F(StreamBudgetTest, TheAddressThatKeepsMostLosesThoseThatHaveMost) {
  for (Id id = 1; id <= 9; ++id) enter(id, "thin");
  for (Id id = 1; id <= 9; ++id) begin(id, 14);
  enter(10, "wide");
  begin(10, 70);
  EXPECT_THAT(look(), IsEmpty());
  begin(3, 6);
  EXPECT_THAT(look(), ElementsAre(3)) << "126 + 6, beside 70";
  budget_.leave(3);
  EXPECT_THAT(look(), IsEmpty());
}

TEST_F(StreamBudgetTest, WhoIsCutOffAnywayIsNotCountedAgainstOthers) {
  for (Id id = 1; id <= 3; ++id) enter(id, "a");
  begin(1, 199), begin(2, 90), begin(3, 90);
  EXPECT_THAT(look(), ElementsAre(1));
}

TEST_F(StreamBudgetTest, CallsInProgressCutOffNobody) {
  for (Id id = 1; id <= 5; ++id) enter(id, "a");
  for (Id id = 1; id <= 4; ++id) begin(id, 100, 90);
  begin(5, 100, 0);
  EXPECT_THAT(look(1s), IsEmpty());
  enter(6, "b");
  begin(6, 61, 0);
  EXPECT_THAT(look(), ElementsAre(5));
}

TEST_F(StreamBudgetTest, StreamsThatPassByCutOffNobody) {
  enter(1, "busy");
  begin(1, 90);
  for (Id id = 2; id <= 20; ++id) {
    enter(id, "thin");
    begin(id, 10);
  }
  // As many as it has end between two looks; the others' last.
  for (int i = 0; i < 100; ++i) {
    begin(1, 30), end(1, 30);
    EXPECT_THAT(look(0ms), IsEmpty());
  }
  begin(2, 11);
  std::vector<Id> cut;
  for (int i = 0; i < 100 && cut.empty(); ++i) {
    begin(1, 30), end(1, 30);
    cut = look(0ms);
  }
  EXPECT_THAT(cut, ElementsAre(2));
}

TEST_F(StreamBudgetTest, ButNotWithoutEnd) {
  // Each ends as many as it keeps, so that none is known to last.
  for (Id id = 1; id <= 10; ++id) {
    enter(id, id < 8 ? "a" : "b");
    begin(id, 40);
  }
  std::vector<Id> cut;
  for (int i = 0; i < 100 && cut.empty(); ++i) {
    for (Id id = 1; id <= 10; ++id) begin(id, 50), end(id, 50);
    cut = look(0ms);
  }
  EXPECT_THAT(cut, IsEmpty());
  begin(5, 1);
  EXPECT_THAT(look(0ms), ElementsAre(5));
}

/// As one that waits to be handed over.
TEST_F(StreamBudgetTest, WhoGrpcDoesNotKnowTakesNoLooksFromOthers) {
  for (Id id = 1; id <= 60; ++id) {
    enter(id, "a");
    begin(id, 4);
  }
  std::set<Id> asked;
  for (int i = 0; i < 20; ++i, now_ += 10ms)
    for (const auto id : budget_.doubtful(now_)) {
      asked.insert(id);
      if (id <= 30)
        budget_.unknown(id, now_);
      else
        budget_.seen(id, peers_.at(id).has, 0, now_);
    }
  EXPECT_THAT(asked, SizeIs(60));
}

TEST_F(StreamBudgetTest, WhatWasSeenLongAgoCountsAgainstNobody) {
  enter(1, "a"), enter(2, "a"), enter(3, "a");
  begin(1, 90), begin(2, 90), begin(3, 30);
  const auto look_at = [this](std::initializer_list<Id> ids) {
    for (const auto id : ids) budget_.seen(id, peers_.at(id).has, 0, now_);
  };
  look_at({1, 2, 3});
  now_ += StreamBudget::lasts_for;
  look_at({1, 2});
  now_ += StreamBudget::known_for;
  look_at({3});
  EXPECT_THAT(budget_.beyond(now_), SizeIs(1)) << "all three are known to last";
  EXPECT_THAT(budget_.beyond(now_ + 1ms), IsEmpty());
}

TEST_F(StreamBudgetTest, WhoLeavesTellsHowManyItHad) {
  enter(1, "a");
  begin(1, 99);
  budget_.seen(1, peers_.at(1).has, 0, now_);
  EXPECT_EQ(budget_.leave(1), 99);
  EXPECT_EQ(budget_.leave(1), 0);
}

}  // namespace
}  // namespace axisd::testing
