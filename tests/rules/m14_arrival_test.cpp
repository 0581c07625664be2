// M14: requests reach the core in another order than they arrived in, as stops overtake them.
#include <gtest/gtest.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

class Overtaken : public testing::Test {
 protected:
  void SetUp() override {
    rig_.ready();
    running_ = rig_.submit(JogRequest{.velocity = 20, .hold = 2s}, at(0ms));
    rig_.run(300ms);
  }
  [[nodiscard]] CommandOptions at(Duration time) const { return {.arrived = began_ + time}; }
  void expect_refused(const Action& action, CommandOptions options) {
    rig_.line->forget_wire();
    const auto refused = rig_.try_submit(action, options);
    ASSERT_FALSE(refused) << to_string(kind_of(action));
    EXPECT_EQ(refused.error().reason, Reason::superseded) << to_string(refused.error());
    EXPECT_EQ(refused.error().outcome, Outcome::not_sent);
    rig_.run(2s);
    EXPECT_EQ(rig_.triggers(), 0);
    EXPECT_FALSE(rig_.drive->shaft_moving());
  }

  /// What arrived long ago is refused by another rule (M31), which is not looked at here.
  Rig rig_{{.adjust = [](AxisSettings& axis) { axis.start_within = std::chrono::minutes(1); }}};
  TimePoint began_ = rig_.world.now();
  CommandPtr running_;
};

TEST_F(Overtaken, WhatArrivedBeforeAHaltDoesNotStartAfterIt) {
  rig_.submit(StopRequest{.kind = StopKind::halt}, at(200ms));
  const Action earlier[] = {JogRequest{.velocity = 20, .hold = 2s}, MoveAbsoluteRequest{.position = 100},
                            MoveVelocityRequest{.velocity = 20}, HomeRequest{}};
  for (const auto& action : earlier) expect_refused(action, at(199ms));
  auto buffered = at(199ms);
  buffered.buffer_mode = BufferMode::buffered;
  expect_refused(MoveAbsoluteRequest{.position = 100}, buffered);
  EXPECT_TRUE(rig_.try_submit(MoveAbsoluteRequest{.position = 100}, at(200ms)));
}

TEST_F(Overtaken, WhatArrivedBeforeACancelDoesNotStartAfterIt) {
  EXPECT_TRUE(rig_.axis().cancel(running_, began_ + 200ms));
  expect_refused(JogRequest{.velocity = 20, .hold = 2s}, at(199ms));
  EXPECT_TRUE(rig_.try_submit(MoveAbsoluteRequest{.position = 100}, at(201ms)));
}

TEST_F(Overtaken, WhatArrivedBeforeADisableDoesNotEnableAfterIt) {
  rig_.submit(DisableRequest{}, at(200ms));
  rig_.run(2s);
  expect_refused(EnableRequest{}, at(199ms));
  EXPECT_FALSE(rig_.state()->enabled);
  EXPECT_TRUE(rig_.try_submit(EnableRequest{}, at(201ms)));
}

TEST_F(Overtaken, NorDoesItWaitBehindWhatCameAfterTheStop) {
  rig_.submit(StopRequest{.kind = StopKind::halt}, at(200ms));
  rig_.run(1s);
  rig_.submit(MoveAbsoluteRequest{.position = 100}, at(300ms));
  auto buffered = at(199ms);
  buffered.buffer_mode = BufferMode::buffered;
  EXPECT_FALSE(rig_.try_submit(MoveAbsoluteRequest{.position = 200}, buffered));
}

}  // namespace
}  // namespace axisd::test
