// M20: open loop. A drive that was out of reach while it moved may have run onto a limit, and lost steps
// there.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/rules/model_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

RigOptions slipping(bool limits = true) {
  return {.switches = {{"abrupt_stop_slips", true}},
          .adjust =
              [](AxisSettings& axis) {
                axis.inputs = {{.terminal = "X1", .function = "positive_limit"},
                               {.terminal = "X2", .function = "negative_limit"}};
              },
          .limits = limits};
}

class OutOfReach {
 public:
  explicit OutOfReach(const RigOptions& options) : rig_(options) { rig_.ready(); }

  /// Nothing passes for 2 s, in which `happens` at the machine.
  template <class Happens>
  void out_of_reach(Happens happens) {
    rig_.fault({.kind = FaultKind::drop_request, .count = -1});
    happens();
    rig_.run(2s);
    ASSERT_EQ(rig_.state()->link, LinkState::offline);
    rig_.faults().clear();
    rig_.reconnect();
    rig_.run(1s);
  }
  /// The load passes the flag of a limit switch, and comes to rest beyond it.
  void pass_limit() {
    for (const auto* limit : {"X1", "X2"}) rig_.set_input(limit, true);
    rig_.run(50ms);
    for (const auto* limit : {"X1", "X2"}) rig_.set_input(limit, false);
  }
  /// What it believes is so.
  void expect_truth() {
    EXPECT_FALSE(rig_.drive->shaft_moving());
    if (rig_.state()->trust != PositionTrust::unknown)
      EXPECT_NEAR(rig_.state()->position, rig_.load_mm(), 0.011);
  }
  Rig& rig() { return rig_; }

 private:
  Rig rig_;
};

TEST(M20OutOfReach, AMoveThatALimitEndedUnseenLosesThePosition) {
  both_directions(slipping(), [](const RigOptions& options) {
    OutOfReach axis(options);
    axis.rig().submit(MoveAbsoluteRequest{.position = 300});
    axis.rig().run(500ms);
    axis.out_of_reach([&] { axis.pass_limit(); });
    EXPECT_GT(std::abs(axis.rig().state()->position - axis.rig().load_mm()), 0.1) << "it slipped";
    EXPECT_EQ(axis.rig().state()->trust, PositionTrust::unknown);
  });
}

TEST(M20OutOfReach, SoDoesAVelocity) {
  both_directions(slipping(false), [](const RigOptions& options) {
    OutOfReach axis(options);
    axis.rig().submit(MoveVelocityRequest{.velocity = 20});
    axis.rig().run(500ms);
    axis.out_of_reach([&] { axis.pass_limit(); });
    EXPECT_GT(std::abs(axis.rig().state()->position - axis.rig().load_mm()), 0.1) << "it slipped";
    EXPECT_EQ(axis.rig().state()->trust, PositionTrust::unknown);
  });
}

TEST(M20OutOfReach, AMoveThatArrivedUnseenKeepsIt) {
  both_directions(slipping(), [](const RigOptions& options) {
    OutOfReach axis(options);
    axis.rig().submit(MoveAbsoluteRequest{.position = 100});
    axis.rig().run(500ms);
    axis.out_of_reach([] {});
    axis.expect_truth();
    EXPECT_EQ(axis.rig().state()->trust, PositionTrust::set);
  });
}

TEST(M20OutOfReach, AnAxisThatRestedKeepsIt) {
  both_directions(slipping(), [](const RigOptions& options) {
    OutOfReach axis(options);
    axis.out_of_reach([] {});
    axis.expect_truth();
    EXPECT_EQ(axis.rig().state()->trust, PositionTrust::set);
  });
}

/// It still ran when the stop reached it that it was owed.
TEST(M20OutOfReach, AMotionThatTheOwedStopEndsKeepsIt) {
  both_directions(slipping(false), [](const RigOptions& options) {
    OutOfReach axis(options);
    axis.rig().submit(MoveVelocityRequest{.velocity = 20});
    axis.rig().run(500ms);
    axis.out_of_reach([] {});
    axis.expect_truth();
    EXPECT_EQ(axis.rig().state()->trust, PositionTrust::set);
  });
}

/// What its limits do the drive keeps to itself.
TEST(M20OutOfReach, ADriveThatShowsNoInputsMayHaveLimits) {
  for (const bool ended : {true, false}) {
    ModelRig rig({.model = "cia402", .noise = 0, .shows_inputs = false, .drive_keys = "loop_mode: open"});
    for (const Action& action : {Action(EnableRequest{}), Action(SetPositionRequest{.position = 0})}) {
      const auto command = rig.complete(action);
      ASSERT_EQ(command.state, CommandState::done) << describe(command);
    }
    const auto move = rig.try_submit(MoveAbsoluteRequest{.position = 100});
    ASSERT_TRUE(move) << to_string(move.error());
    rig.run(300ms);
    ASSERT_TRUE(rig.moving());
    rig.cut(true);
    constexpr std::uint32_t control_word = 0x604000, halt = 0x010F;
    if (ended) rig.write_behind(control_word, halt);
    rig.run(5s);
    ASSERT_EQ(rig.state()->link, LinkState::offline);
    ASSERT_FALSE(rig.moving());
    rig.cut(false);
    rig.reconnect();
    rig.run(1s);
    EXPECT_EQ(rig.state()->trust, ended ? PositionTrust::unknown : PositionTrust::set);
  }
}

}  // namespace
}  // namespace axisd::test
