// A stop at any moment of any motion (M12 to M14): none moves once its stop is done, and each stop ends.
// The drives begin late, so that what is acknowledged is not under way yet.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/rules/late_start_rig.hpp"
#include "tests/rules/m22_group_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

/// Begins a motion, lets that time pass, and stops it.
using Scenario = std::function<CommandPtr(Rig&, Duration)>;

/// Open loop; the same with a terminal that could start a motion; closed loop.
std::map<std::string, RigOptions> machines() {
  auto with_terminal = late();
  with_terminal.switches["enabled_at_power_up"] = false;
  with_terminal.adjust = [](AxisSettings& axis) {
    axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
  };
  return {{"open loop", late()},
          {"start terminal", with_terminal},
          {"closed loop", measured_late("ess42-r", 8ms)}};
}

void sweep(Duration to, Duration step, const Scenario& scenario) {
  for (const auto& [name, options] : machines())
    for (Duration delay{}; delay < to; delay += step) {
      SCOPED_TRACE(testing::Message() << name << ", after " << delay.count() / 1e6 << " ms");
      Rig rig(options);
      rig.ready();
      const auto stop = scenario(rig, delay);
      ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 60s)) << "it does not end";
      EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
      EXPECT_FALSE(is_driven(rig, 700ms)) << "told at rest";
    }
}

/// Begins `motion`, and stops it after a while.
Scenario stopped(const Action& motion, const Action& stop = StopRequest{}) {
  return [=](Rig& rig, Duration delay) {
    rig.submit(motion);
    rig.run(delay);
    return rig.submit(stop);
  };
}

TEST(M14, NoMoveGoesOnOnceItsStopIsDone) {
  sweep(60ms, 700us, stopped(MoveAbsoluteRequest{.position = 300}));
}

TEST(M14, NoVelocityGoesOnOnceItsQuickStopIsDone) {
  sweep(60ms, 1700us,
        stopped(MoveVelocityRequest{.velocity = 50}, StopRequest{.kind = StopKind::quick_stop}));
}

TEST(M14, NoHomingGoesOnOnceItsStopIsDone) { sweep(160ms, 3100us, stopped(HomeRequest{})); }

TEST(M2, NoMoveGoesOnOnceItsDisableIsDone) {
  sweep(160ms, 3100us, stopped(MoveAbsoluteRequest{.position = 300}, DisableRequest{}));
}

TEST(M14, NoJogThatTookAnothersPlaceGoesOnOnceItsStopIsDone) {
  sweep(160ms, 3100us, [](Rig& rig, Duration delay) {
    rig.submit(JogRequest{.velocity = 50, .hold = 2s});
    rig.run(700ms);
    rig.submit(JogRequest{.velocity = -50, .hold = 2s});
    rig.run(600ms + delay);
    return rig.submit(StopRequest{});
  });
}

TEST(M14, NoMoveBehindAHaltGoesOnOnceItsStopIsDone) {
  sweep(160ms, 3100us, [](Rig& rig, Duration delay) {
    rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(900ms);
    rig.complete(StopRequest{.kind = StopKind::halt});
    rig.submit(MoveAbsoluteRequest{.position = 10});
    rig.run(delay);
    return rig.submit(StopRequest{});
  });
}

TEST(M14, NoMoveWhoseStartGotNoReplyGoesOnOnceItsStopIsDone) {
  sweep(160ms, 3100us, [](Rig& rig, Duration delay) {
    rig.fault({.kind = FaultKind::drop_reply, .function = 0x06, .register_address = 0x0027});
    rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(delay);
    return rig.submit(StopRequest{});
  });
}

TEST(M14, NoMoveGoesOnOnceAStopIsDoneOfWhichFramesWereLost) {
  for (const auto lost : {FaultKind::drop_reply, FaultKind::drop_request})
    sweep(160ms, 3100us, [lost](Rig& rig, Duration delay) {
      rig.submit(MoveAbsoluteRequest{.position = 300});
      rig.run(delay);
      rig.fault({.kind = lost, .register_address = 0x0028, .count = 4});
      return rig.submit(StopRequest{});
    });
}

/// Stops member x: both come to rest, and stay there.
void stop_member(GroupRig& rig) {
  const auto stop = rig.machine->submit("x", StopRequest{}, {});
  ASSERT_TRUE(stop) << to_string(stop.error());
  ASSERT_TRUE(rig.run_until(
      [&] { return (*stop)->has_ended() && rig.state("y")->state == AxisState::standstill; }, 20s))
      << describe((*stop)->value()) << ", y: " << to_string(rig.state("y")->state);
  const std::map<std::string, double> before = {{"x", rig.load_mm("x")}, {"y", rig.load_mm("y")}};
  rig.run(700ms);
  // A shaft that follows its motor still settles.
  for (const auto& [axis, place] : before) EXPECT_NEAR(rig.load_mm(axis), place, 0.5) << axis;
}

GroupRigOptions late_group() { return {.can_axes = 0, .serial_switches = {{"starts_late", true}}}; }

TEST(M22, NoMemberGoesOnOnceTheStopOfAnotherIsDone) {
  std::vector<Duration> delays;
  for (Duration delay{}; delay < 60ms; delay += 400us) delays.push_back(delay);
  for (auto delay = 60ms; delay < 170ms; delay += 7ms) delays.push_back(delay);
  for (const auto delay : delays) {
    SCOPED_TRACE(testing::Message() << delay.count() / 1e6 << " ms");
    GroupRig rig(late_group());
    rig.move(GroupRig::to({{"x", 300}, {"y", 200}}));
    rig.run(delay);
    stop_member(rig);
  }
}

/// Of a start that was on the wire when its group was given up nobody tells any more what became of it.
TEST(M22, AMemberWhoseStartWasLostAsItsGroupWasGivenUpComesToRest) {
  GroupRig rig(late_group());
  rig.faults().add({.kind = FaultKind::drop_request, .function = 0x06, .register_address = 0x0027});
  rig.move(GroupRig::to({{"x", 300}, {"y", 200}}));
  ASSERT_TRUE(rig.run_until([&] { return rig.writes(1, 0x0027) + rig.writes(2, 0x0027) > 0; }, 1s));
  stop_member(rig);
}

TEST(M22, NoMemberGoesOnOnceTheStopOfAnotherIsDoneAboutTheMomentOfTheStart) {
  for (auto delay = -20ms; delay < 130ms; delay += delay < 20ms ? 1ms : 7ms) {
    SCOPED_TRACE(testing::Message() << delay.count() << " ms");
    GroupRig rig(late_group());
    auto request = GroupRig::to({{"x", 300}, {"y", 200}});
    request.start = GroupStart::when_told;
    const auto run = rig.move(request);
    ASSERT_TRUE(rig.run_until([&] { return run->prepared(); }, 5s));
    const auto at = rig.world.now() + 400ms;
    ASSERT_TRUE(run->start_at(at));
    run->renew(GroupRenewal::all_told);
    rig.run(at - rig.world.now() + delay);
    stop_member(rig);
  }
}

}  // namespace
}  // namespace axisd::test
