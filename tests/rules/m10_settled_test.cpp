// M10: Done where a measured position alone says little: a way within the window.
#include <gtest/gtest.h>

#include <memory>
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

}  // namespace
}  // namespace axisd::test
