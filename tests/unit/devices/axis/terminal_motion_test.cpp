#include "devices/axis/terminal_motion.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using State = TerminalMotion::State;
using Verdict = TerminalMotion::Verdict;

TEST(TerminalMotion, WhatNothingExplainsIsNobodys) {
  TerminalMotion motion;
  EXPECT_EQ(motion.judge({}), Verdict::nobodys);
  EXPECT_EQ(motion.judge({.just_began = true}), Verdict::nobodys);
  EXPECT_EQ(motion.judge({.terminals_start = true}), Verdict::nobodys);
  EXPECT_EQ(motion.state(), State::none);
}

TEST(TerminalMotion, WhatTheDriveOrATerminalShowsIsATerminals) {
  TerminalMotion motion;
  EXPECT_EQ(motion.judge({.shown = true}), Verdict::begins);
  EXPECT_EQ(motion.state(), State::by_terminal);
  EXPECT_EQ(motion.judge({}), Verdict::known);
}

TEST(TerminalMotion, ADriveThatTakesItsMotionFromElsewhereMovesByItself) {
  TerminalMotion motion;
  EXPECT_EQ(motion.judge({.by_itself = true}), Verdict::begins);
}

TEST(TerminalMotion, ATerminalMayShowOneReadingLater) {
  TerminalMotion motion;
  EXPECT_EQ(motion.judge({.terminals_start = true, .just_began = true}), Verdict::look_again);
  EXPECT_EQ(motion.judge({.terminals_start = true, .just_began = true, .by_itself = true}),
            Verdict::look_again);
  EXPECT_EQ(motion.state(), State::none);
  EXPECT_EQ(motion.judge({.terminals_start = true, .shown = true}), Verdict::begins);
}

TEST(TerminalMotion, AMotorThatWasToldToStopIsNeverATerminals) {
  TerminalMotion motion;
  EXPECT_EQ(motion.judge({.told_to_stop = true,
                          .terminals_start = true,
                          .just_began = true,
                          .shown = true,
                          .by_itself = true}),
            Verdict::nobodys);
}

TEST(TerminalMotion, ItEndsAtRestAndWhereNobodyCanSay) {
  TerminalMotion rests, lost;
  rests.judge({.shown = true});
  rests.at_rest();
  EXPECT_FALSE(rests.moves());
  lost.judge({.shown = true});
  lost.lost();
  EXPECT_FALSE(lost.moves());
}

}  // namespace
}  // namespace axisd
