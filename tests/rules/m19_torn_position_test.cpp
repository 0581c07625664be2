// M19: the position comes in two words, and no manual says that they are of one moment.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// The counter is 0 where the rig powers up: its words carry there.
RigOptions torn(std::string_view model) {
  RigOptions options{
      .model = std::string(model), .switches = {{"position_words_torn", true}}, .limits = false};
  if (model == "ykd2405pr") return options;
  options.adjust = [](AxisSettings& axis) { axis.homing->method = HomingMethod::negative_limit; };
  // In pulses, which are coarser than its counts; at rest as well, and well within its window of 10.
  options.adjust_drive = [](simulation::SimulatedNodeSettings& node) { node.encoder.noise = 3; };
  return options;
}

/// Runs until `command` has ended; no two readings are further apart than the motor can go.
void watch(Rig& rig, const CommandPtr& command) {
  auto before = rig.state()->position;
  for (int ms = 0; ms < 10'000 && !command->has_ended(); ++ms) {
    rig.run(1ms);
    const auto position = rig.state()->position;
    ASSERT_LT(std::abs(position - before), 20) << "from " << before << " to " << position << " mm";
    before = position;
  }
  EXPECT_EQ(command->value().state, CommandState::done) << describe(command->value());
}

class TornWords : public ::testing::TestWithParam<const char*> {};

TEST_P(TornWords, AreNoMotion) {
  both_directions(torn(GetParam()), [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    for (const double target : {3.0, -3.0, 0.0, 20.0, -20.0, 0.0}) {
      SCOPED_TRACE(target);
      ASSERT_NO_FATAL_FAILURE(watch(rig, rig.submit(MoveAbsoluteRequest{.position = target})));
      EXPECT_NEAR(rig.load_mm(), target, 0.2);
    }
    EXPECT_EQ(rig.state()->trust, PositionTrust::set);
  });
}

/// A measured position wavers about the carry while the axis rests there.
TEST_P(TornWords, AreNoReasonToRefuseAnEnable) {
  Rig rig(torn(GetParam()));
  for (int i = 0; i < 20; ++i) {
    ASSERT_NO_FATAL_FAILURE(watch(rig, rig.submit(EnableRequest{})));
    rig.run(std::chrono::milliseconds(137 * i));
    ASSERT_NO_FATAL_FAILURE(watch(rig, rig.submit(DisableRequest{})));
  }
}

INSTANTIATE_TEST_SUITE_P(M19, TornWords, ::testing::Values("ykd2405pr", "ssd2608pr", "ess42-r"),
                         [](const auto& info) {
                           std::string name = info.param;
                           return name == "ess42-r" ? "ess42_r" : name;
                         });

/// Nothing but a torn reading is asked for again.
TEST(M19, APositionThatIsWholeIsReadOnce) {
  for (const bool tears : {false, true}) {
    auto options = torn("ykd2405pr");
    options.switches["position_words_torn"] = tears;
    Rig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = -50}).state, CommandState::done);
    const auto run = rig.submit(MoveVelocityRequest{.velocity = 50});
    rig.run(300ms);
    ASSERT_LT(rig.load_mm(), -5) << "the carry is still to come";
    rig.line->forget_wire();
    rig.run(1500ms);
    ASSERT_GT(rig.load_mm(), 5);
    int at_once = 0;
    std::optional<TimePoint> last;
    for (const auto& entry : rig.line->wire()) {
      if (entry.is_write() || entry.address() != 0x0003) continue;
      if (last && entry.begin - *last < 10ms) ++at_once;
      last = entry.begin;
    }
    EXPECT_EQ(at_once, tears ? 1 : 0);
    rig.complete(StopRequest{});
    EXPECT_TRUE(run->has_ended());
  }
}

}  // namespace
}  // namespace axisd::test
