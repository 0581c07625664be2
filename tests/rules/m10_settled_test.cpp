// M10: Done where a measured position alone says little: a way within the window, and a shaft that rings.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view closed_loops[] = {"ssd2608pr", "ess42-r"};

/// 10000 pulses and 4000 counts per revolution: 1000 pulses per mm, and the window of 10 counts is 25 um.
RigOptions measured(std::string_view model) {
  RigOptions options{.model = std::string(model)};
  options.adjust = [](AxisSettings& axis) {
    axis.scale.pulses_per_revolution = 10'000;
    axis.model_settings["released_position"] = std::string("counted");
  };
  options.adjust_drive = [](simulation::SimulatedNodeSettings& node) {
    node.mechanics = {};
    node.encoder = {.noise = 1, .following = 3ms, .quantised = true, .compliance = 400};
  };
  return options;
}

/// Acknowledges a start at once, and begins some time later.
class StartsLate : public BorrowedNode {
 public:
  StartsLate(simulation::SimulatedRtuNode& node, Duration late)
      : BorrowedNode(node), drive_(&node), late_(late) {}
  void advance(TimePoint now) override {
    if (due_ && *due_ <= now) {
      drive_->advance(*due_);
      (void)drive_->on_frame(start_);
      due_.reset();
    }
    drive_->advance(now);
    now_ = now;
  }
  std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) override {
    constexpr std::uint8_t write = 0x06, start = 0x27;
    if (frame.size() != 8 || frame[1] != write || frame[2] != 0 || frame[3] != start)
      return drive_->on_frame(frame);
    start_.assign(frame.begin(), frame.end());
    due_ = now_ + late_;
    return start_;
  }

 private:
  simulation::SimulatedRtuNode* drive_;
  Duration late_;
  TimePoint now_{};
  std::optional<TimePoint> due_;
  std::vector<std::uint8_t> start_;
};

TEST(M10, AMoveWithinTheWindowIsNotDoneBeforeALateDriveHasMadeIt) {
  for (const auto model : closed_loops)
    for (const auto late : {0ms, 100ms, 150ms, 250ms, 400ms, 480ms})
      for (const double way : {0.004, -0.01, 0.024, -0.04}) {
        SCOPED_TRACE(testing::Message()
                     << model << ", begins " << late.count() << " ms late, " << way << " mm");
        Rig rig(measured(model));
        rig.ready();
        ASSERT_EQ(rig.complete(MoveAbsoluteRequest{.position = 1}).state, CommandState::done);
        auto& network = rig.line->network();
        network.remove(1);
        network.add(std::make_unique<StartsLate>(*rig.drive, late));
        const auto starts = rig.drive->starts();
        const auto from = rig.world.now();
        const auto move = rig.complete(MoveRelativeRequest{.distance = way});
        EXPECT_EQ(move.state, CommandState::done) << describe(move);
        network.advance(rig.world.now());
        EXPECT_EQ(rig.drive->starts(), starts + 1) << "Done, and not begun yet";
        EXPECT_FALSE(rig.drive->shaft_moving()) << "Done, and moving";
        EXPECT_LE(rig.world.now() - from, 700ms);
      }
}

/// The encoder passes the target again and again, and each time the drive is in position for a moment.
TEST(M10, AShaftThatRingsIsNotDoneWhereItCrossesItsTarget) {
  constexpr double counts = 150, fades_within = 0.150, longest_period = 0.100;
  struct Case {
    std::string_view model;
    double target_mm;
  };
  for (const auto& [model, target_mm] :
       {Case{"ssd2608pr", 20}, Case{"ess42-r", 20}, Case{"ssd2608pr", 0.3}, Case{"ess42-r", 0.3}})
    for (double period = 0.017; period < longest_period; period *= 1.3) {
      SCOPED_TRACE(testing::Message() << model << ", " << target_mm << " mm, period " << period << " s");
      Rig rig(measured(model));
      rig.ready();
      const auto move = rig.submit(MoveAbsoluteRequest{.position = target_mm});
      ASSERT_TRUE(rig.run_until([&] { return rig.drive->shaft_moving(); }, 1s));
      ASSERT_TRUE(rig.drive->lean_on_shaft(static_cast<int>(counts)));
      ASSERT_TRUE(rig.run_until([&] { return !rig.drive->shaft_moving(); }, 5s));
      const auto ended = rig.world.now();
      double amplitude = counts;
      while (!move->has_ended()) {
        const auto since = std::chrono::duration<double>(rig.world.now() - ended).count();
        ASSERT_LT(since, 2);
        amplitude = counts * std::exp(-since / fades_within);
        const auto ring = amplitude * std::cos(2 * std::numbers::pi * since / period);
        rig.line->network().advance(rig.world.now());
        ASSERT_TRUE(rig.drive->lean_on_shaft(static_cast<int>(std::lround(ring))));
        rig.run(500us);
      }
      EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
      EXPECT_LE(amplitude, 25) << "counts by which it may be off, and the window is 10";
    }
}

/// A load keeps it there, and the encoder wavers.
TEST(M10, AShaftThatRestsAtTheEdgeOfItsWindowIsDone) {
  for (const auto model : closed_loops)
    for (int counts = 6; counts <= 10; ++counts) {
      SCOPED_TRACE(testing::Message() << model << ", off by " << counts << " counts");
      auto options = measured(model);
      options.adjust_drive = [usual = options.adjust_drive](simulation::SimulatedNodeSettings& node) {
        usual(node);
        node.encoder.noise = 2;
        node.encoder.following = 20ms;
      };
      Rig rig(options);
      rig.ready();
      const auto move = rig.submit(MoveAbsoluteRequest{.position = 20});
      ASSERT_TRUE(rig.run_until([&] { return rig.drive->shaft_moving(); }, 1s));
      ASSERT_TRUE(rig.drive->lean_on_shaft(-counts));
      ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 5s));
      EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
    }
}

}  // namespace
}  // namespace axisd::test
