// M10, M14: how motions end, by the words of PLCopen, on every model.
#include <gtest/gtest.h>

#include <string>

#include "tests/rules/model_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

class EveryModel : public ::testing::TestWithParam<std::string> {
 protected:
  /// Plain and inverted, standing at 100 mm.
  static void each(const std::function<void(ModelRig&)>& test) {
    for (const bool invert : {false, true}) {
      SCOPED_TRACE(invert ? "inverted" : "plain");
      ModelRig rig({.model = GetParam(), .invert = invert, .free_input = false});
      expect(rig.complete(EnableRequest{}), CommandState::done);
      expect(rig.complete(SetPositionRequest{.position = 100}), CommandState::done);
      test(rig);
    }
  }
  static void expect(const Command& command, CommandState state,
                     std::optional<Reason> reason = std::nullopt) {
    EXPECT_EQ(command.state, state) << describe(command);
    if (!reason) return;
    ASSERT_TRUE(command.cause);
    EXPECT_EQ(command.cause->reason, *reason) << describe(command);
  }
  static CommandPtr start(ModelRig& rig, const Action& action) {
    auto command = rig.try_submit(action);
    if (!command) throw std::runtime_error(to_string(command.error()));
    return *command;
  }
  /// It ended in error for this reason, at rest, and nothing goes on before a reset.
  static void expect_error_stop(ModelRig& rig, const CommandPtr& command, Reason reason) {
    ASSERT_TRUE(rig.run_until([&] { return command->has_ended(); }, 60s));
    expect(command->value(), CommandState::error, reason);
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    rig.run(3s);
    EXPECT_FALSE(rig.moving());
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().reason, Reason::fault);
    expect(rig.complete(ResetRequest{}), CommandState::done);
    EXPECT_EQ(rig.state()->state, AxisState::standstill);
    expect(rig.complete(MoveRelativeRequest{.distance = 1}), CommandState::done);
  }
};

TEST_P(EveryModel, WhatDidNotArriveEndsInErrorStop) {
  each([](ModelRig& rig) {
    for (const Action& action :
         {Action(MoveAbsoluteRequest{.position = 200}), Action(MoveRelativeRequest{.distance = -90})}) {
      const auto move = start(rig, action);
      rig.run(400ms);
      if (rig.on_can())
        rig.write_behind(0x604000, 0x010F);  // halt
      else
        rig.write_behind(0x0028, 0);
      expect_error_stop(rig, move, Reason::not_reached);
      expect(rig.complete(SetPositionRequest{.position = 100}), CommandState::done);
    }
  });
}

/// Acknowledged, and nothing else: a stop terminal of which the configuration knows nothing.
TEST_P(EveryModel, WhatDidNotStartEndsInErrorStop) {
  if (GetParam() == "cia402") GTEST_SKIP() << "it has no such terminal";
  each([](ModelRig& rig) {
    const auto function = rig.on_can() ? 0x203005U : GetParam() == "ssd2608pr" ? 0x0044U : 0x0046U;
    rig.write_behind(function, 8);
    rig.touch([](auto& node) { node.set_input("X3", true); });
    rig.run(300ms);
    const auto move = start(rig, MoveRelativeRequest{.distance = 30});
    ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 10s));
    rig.touch([](auto& node) { node.set_input("X3", false); });
    rig.run(100ms);
    expect_error_stop(rig, move, Reason::did_not_start);
  });
}

/// The drive goes much more slowly than it was told.
TEST_P(EveryModel, WhatTookTooLongEndsInErrorStop) {
  for (const bool invert : {false, true}) {
    SCOPED_TRACE(invert ? "inverted" : "plain");
    const bool serial = GetParam() != "yss-c" && GetParam() != "cia402";
    ModelRigOptions options{.model = GetParam(), .invert = invert};
    if (serial) options.switches["start_in_motion"] = true;
    ModelRig rig(options);
    expect(rig.complete(EnableRequest{}), CommandState::done);
    expect(rig.complete(SetPositionRequest{.position = 100}), CommandState::done);
    const auto move = start(rig, MoveAbsoluteRequest{.position = 300});
    rig.run(300ms);
    if (serial) {
      const auto full = rig.drive->peek(0x0023);
      rig.write_behind(0x0023, 10);
      rig.write_behind(0x0027, 5);
      rig.write_behind(0x0023, full);
    } else {
      const auto full = rig.drive->peek(0x608100);
      rig.write_behind(0x608100, full / 50, 4);
      rig.write_behind(0x604000, 0x2F);
      rig.write_behind(0x604000, 0x3F);  // a change set at once
      rig.write_behind(0x604000, 0x2F);
      rig.write_behind(0x608100, full, 4);
    }
    expect_error_stop(rig, move, Reason::took_too_long);
  }
}

TEST_P(EveryModel, AHaltIsADiscreteMotion) {
  each([](ModelRig& rig) {
    const Action motions[] = {MoveAbsoluteRequest{.position = 300}, MoveRelativeRequest{.distance = -140},
                              MoveVelocityRequest{.velocity = 60}, JogRequest{.velocity = -60, .hold = 2s}};
    for (const auto& motion : motions) {
      start(rig, motion);
      rig.run(600ms);
      EXPECT_TRUE(rig.moving());
      const auto halt = start(rig, StopRequest{.kind = StopKind::halt});
      while (!halt->has_ended()) {
        EXPECT_EQ(rig.state()->state, AxisState::discrete_motion);
        rig.run(2ms);
      }
      expect(halt->value(), CommandState::done);
      EXPECT_EQ(rig.state()->state, AxisState::standstill);
      EXPECT_FALSE(rig.moving());
    }
  });
}

TEST_P(EveryModel, AJogWhoseHoldExpiresIsAborted) {
  each([](ModelRig& rig) {
    for (const double velocity : {50.0, -50.0}) {
      const auto jog = start(rig, JogRequest{.velocity = velocity, .hold = 300ms});
      ASSERT_TRUE(rig.run_until([&] { return jog->has_ended(); }, 2s));
      expect(jog->value(), CommandState::aborted, Reason::expired);
      EXPECT_EQ(rig.state()->state, AxisState::discrete_motion) << "it halts";
      ASSERT_TRUE(rig.run_until([&] { return rig.state()->state == AxisState::standstill; }, 3s));
      EXPECT_FALSE(rig.moving());
    }
  });
}

INSTANTIATE_TEST_SUITE_P(M10, EveryModel, ::testing::ValuesIn(simulated_models()), [](const auto& info) {
  std::string name = info.param;
  std::erase(name, '-');
  return name;
});

}  // namespace
}  // namespace axisd::test
