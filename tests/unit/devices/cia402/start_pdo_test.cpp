#include "devices/cia402/start_pdo.hpp"

#include <gtest/gtest.h>

namespace axisd::cia402 {
namespace {

using State = StartPdo::State;

constexpr std::uint32_t pdo = 0x305;

TEST(StartPdo, ThereIsNoneUntilItIsConfigured) {
  StartPdo start;
  EXPECT_EQ(start.state(), State::absent);
  EXPECT_EQ(start.note(), "it is not configured yet");
  start.refuse("RPDO 2: it is read-only");
  EXPECT_EQ(start.state(), State::absent);
  EXPECT_EQ(start.note(), "RPDO 2: it is read-only");
}

TEST(StartPdo, ItHasToBeProven) {
  StartPdo start;
  start.configure(pdo);
  EXPECT_EQ(start.state(), State::unproven);
  EXPECT_EQ(start.id(), pdo);
  EXPECT_FALSE(start.note().empty());
  start.note_obstacle("the drive is enabled");
  EXPECT_EQ(start.state(), State::unproven);
  EXPECT_EQ(start.note(), "not proven yet: the drive is enabled");
  start.judge("");
  EXPECT_EQ(start.state(), State::proven);
  EXPECT_TRUE(start.note().empty());
  EXPECT_EQ(start.id(), pdo);
}

TEST(StartPdo, ADriveThatDiffersDoesNotStartByIt) {
  StartPdo start;
  start.configure(pdo);
  start.judge("its RPDO acts before the SYNC");
  EXPECT_EQ(start.state(), State::disproven);
  EXPECT_FALSE(start.id());
  EXPECT_EQ(start.note(), "its RPDO acts before the SYNC");
}

TEST(StartPdo, APowerCycleEndsAProof) {
  StartPdo start;
  start.configure(pdo);
  start.judge("");
  start.forget();
  EXPECT_EQ(start.state(), State::absent);
  EXPECT_FALSE(start.id());
  start.judge("");
  start.note_obstacle("late");
  EXPECT_EQ(start.state(), State::absent);
  EXPECT_EQ(start.note(), "it is not configured yet");
}

TEST(StartPdo, WhatIsRefusedIsNotStartedBy) {
  StartPdo start;
  start.configure(pdo);
  start.judge("");
  start.refuse("the network has no SYNC");
  EXPECT_EQ(start.state(), State::absent);
  EXPECT_FALSE(start.id());
}

TEST(StartPdo, APowerCycleEndsWhatWasNotProvenYet) {
  StartPdo start;
  start.configure(pdo);
  start.forget();
  EXPECT_EQ(start.state(), State::absent);
}

TEST(StartPdo, WhatDiffersIsKnownUntilItIsConfiguredAnew) {
  StartPdo start;
  start.configure(pdo);
  start.judge("it differs");
  start.forget();
  EXPECT_EQ(start.state(), State::disproven);
  start.configure(pdo);
  EXPECT_EQ(start.state(), State::unproven);
}

TEST(StartPdo, WhatWasPreparedIsNotSentAfterSomethingElseWasBegun) {
  StartPdo start;
  const auto before = start.guard();
  EXPECT_EQ(may_send(before, TimePoint{}), Verdict::send);
  start.give_up();
  EXPECT_EQ(may_send(before, TimePoint{}), Verdict::superseded);
  EXPECT_EQ(may_send(start.guard(), TimePoint{}), Verdict::send);
}

TEST(StartPdo, OneSequenceAtATimeHasTheNode) {
  StartPdo start;
  start.begin(StartPdo::Work::proving);
  EXPECT_EQ(start.work(), StartPdo::Work::proving);
  start.end_work();
  EXPECT_EQ(start.work(), StartPdo::Work::none);
}

}  // namespace
}  // namespace axisd::cia402
