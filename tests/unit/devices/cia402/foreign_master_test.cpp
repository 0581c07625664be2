#include "devices/cia402/foreign_master.hpp"

#include <gtest/gtest.h>

namespace axisd::cia402 {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint start{1h};

TEST(ForeignMaster, WhatComesInARowIsToldOnce) {
  ForeignMaster master;
  EXPECT_FALSE(master.concerns(start));
  EXPECT_TRUE(master.note("reset the node", start));
  EXPECT_FALSE(master.note("started the node", start + 10s));
  EXPECT_EQ(master.text(), "another master reset the node");
  EXPECT_TRUE(master.concerns(start + 20s));
  EXPECT_FALSE(master.concerns(start + 20s + 1ms));
}

TEST(ForeignMaster, AfterAPauseItIsAnotherConcern) {
  ForeignMaster master;
  EXPECT_TRUE(master.note("reset the node", start));
  EXPECT_TRUE(master.note("started the node", start + 11s));
  EXPECT_EQ(master.text(), "another master started the node");
}

}  // namespace
}  // namespace axisd::cia402
