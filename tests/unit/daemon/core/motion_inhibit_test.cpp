#include "daemon/core/motion_inhibit.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tests/support/fake_persistence.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using What = InhibitChange::What;

class Inhibit : public testing::Test {
 protected:
  std::unique_ptr<MotionInhibit> make(Persistence* persistence) {
    return std::make_unique<MotionInhibit>(
        world_.clock(), persistence, [this](InhibitChange change) { told_.push_back(std::move(change)); });
  }
  /// What its answer is, once there is one.
  auto into(std::optional<std::optional<Error>>& answer) {
    return [&answer](std::optional<Error> error) {
      EXPECT_FALSE(answer) << "answered twice";
      answer = std::move(error);
    };
  }
  auto into(std::optional<Result<void>>& answer) {
    return [&answer](Result<void> result) {
      EXPECT_FALSE(answer) << "answered twice";
      answer = std::move(result);
    };
  }

  test::VirtualWorld world_;
  test::FakePersistence disk_{world_.executor()};
  std::vector<InhibitChange> told_;
};

TEST_F(Inhibit, IsReleasedAtFirst) {
  const auto inhibit = make(&disk_);
  inhibit->start();
  EXPECT_FALSE(*inhibit->latched());
  EXPECT_EQ(inhibit->by(), nullptr);
  EXPECT_TRUE(told_.empty());
}

TEST_F(Inhibit, IsLatchedAtOnceAndSaysWhenThatIsDurable) {
  const auto inhibit = make(&disk_);
  disk_.slow = true;
  std::optional<std::optional<Error>> answer;
  inhibit->latch("panel", into(answer));
  EXPECT_TRUE(*inhibit->latched());
  EXPECT_EQ(*inhibit->by(), "panel");
  EXPECT_FALSE(answer);
  disk_.release();
  world_.run_for(1ms);
  ASSERT_TRUE(answer);
  EXPECT_FALSE(*answer);
  EXPECT_TRUE(disk_.saved.inhibit.active);
  EXPECT_TRUE(told_.empty());
}

TEST_F(Inhibit, IsOfWhoeverLatchedItLast) {
  const auto inhibit = make(&disk_);
  inhibit->latch("panel", {});
  inhibit->latch("shift", {});
  EXPECT_EQ(*inhibit->by(), "shift");
}

TEST_F(Inhibit, ALatchThatIsNotDurableStandsAndIsTold) {
  const auto inhibit = make(&disk_);
  disk_.failing = true;
  std::optional<std::optional<Error>> answer;
  inhibit->latch("panel", into(answer));
  world_.run_for(1ms);
  ASSERT_TRUE(answer && *answer);
  EXPECT_EQ((*answer)->reason, Reason::storage);
  EXPECT_TRUE(*inhibit->latched());
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(told_.front().what, What::not_durable);
}

TEST_F(Inhibit, NobodyWaitsForADiskThatHangs) {
  const auto inhibit = make(&disk_);
  disk_.slow = true;
  std::optional<std::optional<Error>> answer;
  inhibit->latch("panel", into(answer));
  world_.run_for(1min);
  ASSERT_TRUE(answer && *answer);
  EXPECT_EQ((*answer)->reason, Reason::storage);
  disk_.release();
  world_.run_for(1ms);
  EXPECT_TRUE(*inhibit->latched());
}

TEST_F(Inhibit, IsReleasedOnceThatIsDurable) {
  const auto inhibit = make(&disk_);
  inhibit->latch("panel", {});
  world_.run_for(1ms);
  disk_.slow = true;
  std::optional<Result<void>> answer;
  inhibit->release("shift", into(answer));
  EXPECT_TRUE(*inhibit->latched()) << "a restart now would find it latched";
  disk_.release();
  world_.run_for(1ms);
  ASSERT_TRUE(answer && *answer);
  EXPECT_FALSE(*inhibit->latched());
  EXPECT_EQ(inhibit->by(), nullptr);
  EXPECT_FALSE(disk_.saved.inhibit.active);
}

TEST_F(Inhibit, ALatchMeanwhileOutlivesARelease) {
  const auto inhibit = make(&disk_);
  inhibit->latch("panel", {});
  world_.run_for(1ms);
  disk_.slow = true;
  std::optional<Result<void>> answer;
  inhibit->release("shift", into(answer));
  inhibit->latch("door", {});
  disk_.release();
  world_.run_for(1ms);
  ASSERT_TRUE(answer && !*answer);
  EXPECT_EQ(answer->error().reason, Reason::inhibited);
  EXPECT_TRUE(*inhibit->latched());
  EXPECT_EQ(*inhibit->by(), "door");
}

TEST_F(Inhibit, WhatCannotBeSavedIsNotReleased) {
  const auto inhibit = make(&disk_);
  inhibit->latch("panel", {});
  world_.run_for(1ms);
  disk_.failing = true;
  std::optional<Result<void>> answer;
  inhibit->release("panel", into(answer));
  world_.run_for(1ms);
  ASSERT_TRUE(answer && !*answer);
  EXPECT_EQ(answer->error().reason, Reason::storage);
  EXPECT_TRUE(*inhibit->latched());
}

TEST_F(Inhibit, OutlivesARestart) {
  make(&disk_)->latch("panel", {});
  disk_.restart();
  const auto next = make(&disk_);
  EXPECT_TRUE(*next->latched());
  EXPECT_EQ(*next->by(), "panel");
  next->start();
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(told_.front().what, What::stands);
  EXPECT_EQ(told_.front().by, "panel");
}

TEST_F(Inhibit, TheDiskMayAnswerWhenItIsGone) {
  disk_.slow = true;
  bool answered = false;
  auto inhibit = make(&disk_);
  inhibit->latch("panel", {});
  inhibit->release("panel", [&answered](const Result<void>&) { answered = true; });
  inhibit.reset();
  disk_.release();
  world_.run_for(1ms);
  EXPECT_FALSE(answered);
  EXPECT_TRUE(told_.empty());
}

TEST_F(Inhibit, WithoutPersistenceItIsDoneAtOnce) {
  const auto inhibit = make(nullptr);
  std::optional<std::optional<Error>> latched;
  inhibit->latch("panel", into(latched));
  ASSERT_TRUE(latched);
  EXPECT_FALSE(*latched);
  std::optional<Result<void>> released;
  inhibit->release("panel", into(released));
  ASSERT_TRUE(released && *released);
  EXPECT_FALSE(*inhibit->latched());
}

}  // namespace
}  // namespace axisd::core
