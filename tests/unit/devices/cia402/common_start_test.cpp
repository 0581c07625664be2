#include "devices/cia402/common_start.hpp"

#include <gtest/gtest.h>

namespace axisd::cia402 {
namespace {

using State = CommonStart::State;

constexpr std::uint32_t pdo = 0x305;

TEST(CommonStart, ThereIsNoneUntilItIsConfigured) {
  CommonStart start;
  EXPECT_EQ(start.state(), State::absent);
  EXPECT_EQ(start.note(), "it is not configured yet");
  start.refuse("RPDO 2: it is read-only");
  EXPECT_EQ(start.state(), State::absent);
  EXPECT_EQ(start.note(), "RPDO 2: it is read-only");
}

TEST(CommonStart, ItHasToBeProven) {
  CommonStart start;
  start.configure(pdo);
  EXPECT_EQ(start.state(), State::unproven);
  EXPECT_EQ(start.pdo(), pdo);
  EXPECT_FALSE(start.note().empty());
  start.note_obstacle("the drive is enabled");
  EXPECT_EQ(start.state(), State::unproven);
  EXPECT_EQ(start.note(), "not proven yet: the drive is enabled");
  start.judge("");
  EXPECT_EQ(start.state(), State::proven);
  EXPECT_TRUE(start.note().empty());
  EXPECT_EQ(start.pdo(), pdo);
}

TEST(CommonStart, ADriveThatDiffersDoesNotStartByIt) {
  CommonStart start;
  start.configure(pdo);
  start.judge("its RPDO acts before the SYNC");
  EXPECT_EQ(start.state(), State::disproven);
  EXPECT_FALSE(start.pdo());
  EXPECT_EQ(start.note(), "its RPDO acts before the SYNC");
}

TEST(CommonStart, APowerCycleEndsAProof) {
  CommonStart start;
  start.configure(pdo);
  start.judge("");
  start.forget();
  EXPECT_EQ(start.state(), State::absent);
  EXPECT_FALSE(start.pdo());
  start.judge("");
  start.note_obstacle("late");
  EXPECT_EQ(start.state(), State::absent);
  EXPECT_EQ(start.note(), "it is not configured yet");
}

TEST(CommonStart, WhatDiffersIsKnownUntilItIsConfiguredAnew) {
  CommonStart start;
  start.configure(pdo);
  start.judge("it differs");
  start.forget();
  EXPECT_EQ(start.state(), State::disproven);
  start.configure(pdo);
  EXPECT_EQ(start.state(), State::unproven);
}

TEST(CommonStart, OneSequenceAtATimeHasTheNode) {
  CommonStart start;
  start.begin(CommonStart::Work::proving);
  EXPECT_EQ(start.work(), CommonStart::Work::proving);
  start.end_work();
  EXPECT_EQ(start.work(), CommonStart::Work::none);
}

}  // namespace
}  // namespace axisd::cia402
