#include <gtest/gtest.h>

#include "devices/cia402/state_link.hpp"

namespace axisd::cia402 {
namespace {

using State = StateWay::State;

constexpr auto no_pdos = "state by SDO polling: its TPDOs do not come";

StateWay missing() {
  StateWay way;
  way.expect();
  for (int i = 0; i < 3; ++i) way.miss();
  return way;
}

TEST(StateWay, BeforeTheDriveIsConfiguredThereIsNothingToTell) {
  StateWay way;
  EXPECT_EQ(way.state(), State::by_sdo);
  EXPECT_EQ(way.note(), "");
  way.miss();
  way.polled();
  way.came();
  EXPECT_EQ(way.state(), State::by_sdo);
  EXPECT_EQ(way.note(), "");
}

TEST(StateWay, ADriveThatCannotSendItsStateIsPolled) {
  StateWay way;
  way.refuse("TPDO 1: it is read-only");
  EXPECT_EQ(way.state(), State::by_sdo);
  EXPECT_EQ(way.note(), "state by SDO polling: TPDO 1: it is read-only");
  EXPECT_FALSE(way.fails());
}

TEST(StateWay, OneThatSendsItHasNothingToTell) {
  StateWay way;
  way.refuse("TPDO 1: it is read-only");
  way.expect();
  EXPECT_EQ(way.state(), State::by_pdo);
  EXPECT_EQ(way.note(), "");
  way.polled();
  EXPECT_EQ(way.state(), State::by_pdo) << "some reading by SDO is as it should be";
}

TEST(StateWay, TheThirdThatIsMissedInARowCounts) {
  StateWay way;
  way.expect();
  way.miss();
  way.miss();
  way.came();
  way.miss();
  way.miss();
  EXPECT_EQ(way.state(), State::by_pdo);
  way.miss();
  EXPECT_EQ(way.state(), State::missing);
  EXPECT_TRUE(way.fails());
  EXPECT_EQ(way.note(), "") << "the drive may be gone altogether";
}

TEST(StateWay, OnceTheObjectsTellInsteadThisIsSaid) {
  auto way = missing();
  way.polled();
  EXPECT_EQ(way.state(), State::replaced);
  EXPECT_TRUE(way.fails());
  EXPECT_EQ(way.note(), no_pdos);
  way.miss();
  way.polled();
  EXPECT_EQ(way.state(), State::replaced);
}

TEST(StateWay, WhatComesAgainIsGoneByAgain) {
  auto way = missing();
  way.came();
  EXPECT_EQ(way.state(), State::by_pdo);
  auto replaced = missing();
  replaced.polled();
  replaced.came();
  EXPECT_EQ(replaced.state(), State::by_pdo);
  EXPECT_EQ(replaced.note(), "");
  replaced.miss();
  EXPECT_EQ(replaced.state(), State::by_pdo) << "counted anew";
}

TEST(StateWay, AnotherConfigurationBeginsAnew) {
  auto way = missing();
  way.polled();
  way.expect();
  EXPECT_EQ(way.state(), State::by_pdo);
  way = missing();
  way.refuse("a TPDO has the identifier of another node's");
  EXPECT_EQ(way.state(), State::by_sdo);
  EXPECT_FALSE(way.fails());
}

}  // namespace
}  // namespace axisd::cia402
