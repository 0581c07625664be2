#include "devices/axis/plcopen_state.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using Shown = StopMachine::Shown;

/// Everything at once; each test takes away what is stronger than what it shows.
StateSources all() {
  return {.fault = true,
          .stop = Shown::stopping,
          .executed = AxisState::synchronized_motion,
          .moved_by_terminal = DriveMode::homing,
          .energised = true};
}

TEST(PlcopenState, AFaultIsStrongerThanEverything) {
  EXPECT_EQ(plcopen_state(all()), AxisState::error_stop);
  EXPECT_EQ(plcopen_state({.fault = true}), AxisState::error_stop);
}

TEST(PlcopenState, AStopIsStrongerThanAMotion) {
  auto sources = all();
  sources.fault = false;
  EXPECT_EQ(plcopen_state(sources), AxisState::stopping);
}

TEST(PlcopenState, ACommandShowsItsOwnStateAlsoWhileTheMotionBeforeItIsHalted) {
  auto sources = all();
  sources.fault = false;
  sources.stop = Shown::ended_motion;
  for (const auto state : {AxisState::homing, AxisState::discrete_motion, AxisState::continuous_motion,
                           AxisState::synchronized_motion}) {
    sources.executed = state;
    EXPECT_EQ(plcopen_state(sources), state);
  }
}

TEST(PlcopenState, AHaltShowsDiscreteMotionUntilTheAxisRests) {
  auto sources = all();
  sources.fault = false;
  sources.stop = Shown::ended_motion;
  sources.executed = AxisState::standstill;
  EXPECT_EQ(plcopen_state(sources), AxisState::discrete_motion);
}

TEST(PlcopenState, WhatATerminalMovesShowsTheModeOfTheDrive) {
  const auto state = [](DriveMode mode) {
    return plcopen_state({.moved_by_terminal = mode, .energised = true});
  };
  EXPECT_EQ(state(DriveMode::homing), AxisState::homing);
  EXPECT_EQ(state(DriveMode::multi_velocity), AxisState::continuous_motion);
  EXPECT_EQ(state(DriveMode::multi_position), AxisState::discrete_motion);
  EXPECT_EQ(state(DriveMode::positioning), AxisState::discrete_motion);
}

TEST(PlcopenState, AtRestItFollowsTheEnableBitOfTheDrive) {
  EXPECT_EQ(plcopen_state({.energised = true}), AxisState::standstill);
  EXPECT_EQ(plcopen_state({}), AxisState::disabled);
}

}  // namespace
}  // namespace axisd
