#include "tests/rules/trust_journey.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string_view>
#include <utility>

#include "tests/support/rig.hpp"

namespace axisd::test {

namespace {

using namespace std::chrono_literals;

/// mm that a trusted position may be off: the in-position window of 10 pulses, and what an encoder wavers.
constexpr double window = 0.12;
/// mm beside the switch at which homing may end: it passes it, and compensates for nothing.
constexpr double homing_window = 3;

class Journey {
 public:
  explicit Journey(const ModelRigOptions& options)
      : rig_(options),
        inverted_(options.invert),
        free_stop_(options.drive_keys.find("overtravel_stop: free") != std::string::npos),
        home_at_(options.invert ? ModelRig::negative_limit_edge : ModelRig::home_edge) {}

  ModelRig& rig() { return rig_; }
  [[nodiscard]] bool inverted() const { return inverted_; }

  /// The one check: what it believes is so.
  void judge(std::string_view after) {
    rig_.run(400ms);
    EXPECT_FALSE(rig_.moving()) << after;
    const auto state = rig_.state();
    if (state->trust == PositionTrust::unknown) return;
    EXPECT_NEAR(state->position, rig_.load_mm() - origin_, window)
        << "after " << after << " it is " << to_string(state->trust);
  }

  void done(const Action& action, std::string_view what) {
    const auto command = rig_.complete(action);
    EXPECT_EQ(command.state, CommandState::done) << what << ": " << describe(command);
  }

  void enable() {
    rig_.complete(ResetRequest{});
    // A free stop at a limit may release the motor and leave Operation Enabled: only a disable leads out of
    // it.
    if (free_stop_ && !rig_.state()->enabled) done(DisableRequest{}, "disable");
    done(EnableRequest{}, "enable");
  }

  /// Goes on with a known position, as an operator would: where the load stands is measured by other means.
  void know() {
    enable();
    if (rig_.state()->trust != PositionTrust::unknown) return;
    done(SetPositionRequest{.position = rig_.load_mm()}, "set position");
    origin_ = 0;
  }

  void move_by(double mm, std::string_view after) {
    const auto before = rig_.load_mm();
    done(MoveRelativeRequest{.distance = mm}, after);
    EXPECT_NEAR(rig_.load_mm() - before, mm, window) << "a relative move after " << after;
    judge("a relative move");
  }

  void move_to(double mm) {
    done(MoveAbsoluteRequest{.position = mm}, "an absolute move");
    EXPECT_NEAR(rig_.load_mm() - origin_, mm, window);
    judge("an absolute move");
  }

  void home() {
    done(HomeRequest{}, "home");
    EXPECT_EQ(rig_.state()->trust, PositionTrust::homed);
    const auto origin = rig_.load_mm() - rig_.state()->position;
    EXPECT_NEAR(origin + 3, home_at_, homing_window);
    if (homed_) EXPECT_NEAR(origin, *homed_, window) << "home is elsewhere now";
    homed_ = origin_ = origin;
    judge("homing");
  }

  void forget_home() { homed_.reset(); }

  /// Goes towards the other end of the travel, and is interrupted at full speed.
  void interrupted(const std::function<void()>& interrupt, std::string_view what, const Action& motion) {
    know();
    const auto command = rig_.try_submit(motion);
    ASSERT_TRUE(command) << what << ": " << to_string(command.error());
    rig_.run(700ms);
    EXPECT_TRUE(rig_.moving()) << what;
    interrupt();
    EXPECT_TRUE(rig_.run_until([&] { return (*command)->has_ended() && !rig_.moving(); }, 30s)) << what;
    EXPECT_NE((*command)->value().state, CommandState::done) << what;
    rig_.run_until([&] { return rig_.state()->state != AxisState::discrete_motion; }, 5s);
    judge(what);
  }

  [[nodiscard]] Action to_middle() {
    const auto here = rig_.load_mm();
    return MoveAbsoluteRequest{.position = here - origin_ + (here > 150 ? -140 : 140)};
  }

 private:
  ModelRig rig_;
  bool inverted_;
  bool free_stop_;
  double home_at_;
  double origin_ = 0;  ///< the load is at this when the axis says 0
  std::optional<double> homed_;
};

void moves(Journey& axis) {
  axis.enable();
  axis.move_by(9.5, "power-up");
  axis.move_by(-7.5, "a move");
  axis.home();
  axis.move_to(100);
  axis.move_by(100.0 / 3, "an absolute move");
  axis.move_by(-0.02, "a relative move");
}

void stops(Journey& axis) {
  auto& rig = axis.rig();
  for (const auto& [kind, what] : {std::pair(StopKind::halt, "a halt"), std::pair(StopKind::stop, "a stop"),
                                   std::pair(StopKind::quick_stop, "a quick stop")}) {
    axis.interrupted([&] { axis.done(StopRequest{.kind = kind}, what); }, what, axis.to_middle());
    axis.enable();
    axis.move_by(3, what);
  }
  axis.interrupted([] {}, "a jog that expired", JogRequest{.velocity = 60, .hold = 900ms});
  axis.interrupted([&] { axis.done(DisableRequest{}, "disable"); }, "a disable in motion", axis.to_middle());
  axis.know();
  axis.done(DisableRequest{}, "disable");
  axis.judge("a disable");
  EXPECT_TRUE(rig.turn(9));
  axis.judge("a hand at the released shaft");
  axis.enable();
  axis.judge("an enable after a hand turned the shaft");
  axis.move_by(-4, "a hand at the released shaft");
}

/// A stop without a ramp, while another one brakes.
void quick_stop_in_halt(Journey& axis) {
  auto& rig = axis.rig();
  axis.interrupted(
      [&] {
        const auto halt = rig.try_submit(StopRequest{.kind = StopKind::halt});
        rig.run(20ms);
        axis.done(StopRequest{.kind = StopKind::quick_stop}, "a quick stop");
      },
      "a quick stop while it halts", axis.to_middle());
  axis.enable();
  axis.move_by(3, "a quick stop while it halts");
}

void terminals(Journey& axis) {
  auto& rig = axis.rig();
  for (const auto* limit : {"positive_limit", "negative_limit"}) {
    const double way = limit == std::string_view("positive_limit") ? 1 : -1;
    axis.know();
    axis.move_to(175);
    const Action motions[] = {MoveAbsoluteRequest{.position = 175 + 140 * way},
                              MoveRelativeRequest{.distance = 140 * way},
                              JogRequest{.velocity = 100 * way, .hold = 2s}};
    for (const auto& motion : motions) {
      axis.interrupted([&] { rig.set_input(limit, true); }, limit, motion);
      rig.free_input(limit);
      rig.run(100ms);
      axis.know();
      axis.move_to(175);
    }
  }
  if (!rig.has_terminal("motor_free")) return;
  rig.set_input("motor_free", true);
  rig.run(500ms);
  EXPECT_TRUE(rig.turn(-6));
  rig.set_input("motor_free", false);
  axis.judge("motor_free");
  axis.enable();
  axis.judge("an enable after motor_free");
  axis.move_by(2, "motor_free");
  axis.interrupted([&] { rig.set_input("motor_free", true); }, "motor_free in motion", axis.to_middle());
  rig.set_input("motor_free", false);
  rig.run(100ms);
}

void faults(Journey& axis) {
  auto& rig = axis.rig();
  const auto code = rig.drive->alarms()[1];
  axis.interrupted([&] { rig.touch([&](auto& drive) { drive.raise_alarm(code); }); }, "an alarm",
                   axis.to_middle());
  rig.turn(5);
  axis.judge("a hand at the shaft in alarm");
  rig.touch([](auto& drive) { drive.raise_alarm(0); });
  rig.run(100ms);
  axis.enable();
  axis.judge("a reset");
  axis.move_by(2, "an alarm");
  axis.know();
  rig.touch([](auto& drive) { drive.set_power(false); });
  rig.run(300ms);
  EXPECT_TRUE(rig.turn(4));
  rig.touch([](auto& drive) { drive.set_power(true); });
  rig.run(1s);
  rig.reconnect();
  axis.judge("a power cycle");
  axis.enable();
  axis.move_by(2, "a power cycle");
}

void restarts(Journey& axis) {
  auto& rig = axis.rig();
  axis.know();
  rig.stop_daemon();
  rig.run(300ms);
  rig.start_daemon();
  axis.judge("a restart of the daemon");
  axis.enable();
  axis.move_by(2, "a restart of the daemon");
  if (rig.has_terminal("motor_free")) {
    axis.know();
    rig.stop_daemon();
    rig.set_input("motor_free", true);
    rig.run(100ms);
    EXPECT_TRUE(rig.turn(6));
    rig.set_input("motor_free", false);
    rig.run(100ms);
    rig.start_daemon();
    axis.judge("motor_free while there was no daemon");
  }
  axis.know();
  axis.done(DisableRequest{}, "disable");
  rig.stop_daemon();
  EXPECT_TRUE(rig.turn(-6));
  rig.start_daemon();
  axis.judge("a hand at the shaft while there was no daemon");
  axis.enable();
  axis.move_by(2, "a restart of the daemon");
}

void homings(Journey& axis) {
  auto& rig = axis.rig();
  axis.enable();
  axis.home();
  axis.move_to(60);
  const auto homing = rig.try_submit(HomeRequest{});
  ASSERT_TRUE(homing);
  rig.run(900ms);
  // Where a drive does not take a stop while homing, that is told, and it homes on.
  const auto stop = rig.complete(StopRequest{});
  if (stop.state != CommandState::done)
    EXPECT_EQ(stop.cause->reason, Reason::not_confirmed) << describe(stop);
  EXPECT_TRUE(rig.run_until([&] { return !rig.moving(); }, 40s));
  axis.judge("homing that was stopped");
  axis.enable();
  axis.move_by(2, "homing that was stopped");
  axis.home();
  axis.home();  // from where it stands on the switch, or beside it
  if (axis.inverted()) return;
  axis.move_by(-5, "homing");  // beyond the home switch: the way goes over the limit
  axis.forget_home();          // a drive may end at the other edge of the switch then
  axis.home();
}

/// In the drive's velocity mode.
void endless(Journey& axis) {
  auto& rig = axis.rig();
  for (const double velocity : {60.0, -60.0}) {
    const MoveVelocityRequest run{.velocity = velocity};
    axis.interrupted([&] { axis.done(StopRequest{.kind = StopKind::halt}, "a halt"); }, "a halt of a run",
                     run);
    axis.interrupted([&] { axis.done(StopRequest{.kind = StopKind::quick_stop}, "a quick stop"); },
                     "a quick stop of a run", run);
    const auto* limit = velocity > 0 ? "positive_limit" : "negative_limit";
    axis.interrupted([&] { rig.set_input(limit, true); }, "a limit in a run", run);
    rig.free_input(limit);
    axis.judge("a limit that opened");
    axis.enable();
    axis.move_by(velocity > 0 ? -3 : 3, "a limit in a run");
  }
}

}  // namespace

std::uint64_t travel(const ModelRigOptions& options) {
  Journey axis(options);
  for (auto* const part : {&moves, &stops, &quick_stop_in_halt, &terminals, &faults, &restarts, &homings}) {
    part(axis);
    if (::testing::Test::HasFatalFailure()) break;
  }
  auto without_limits = options;
  without_limits.limits = false;
  Journey run(without_limits);
  endless(run);
  return axis.rig().wire_hash() ^ run.rig().wire_hash();
}

}  // namespace axisd::test
