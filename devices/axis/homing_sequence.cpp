// Homing: by the drive itself, watched from here (M21).
#include "devices/axis/homing_sequence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "devices/axis/execution.hpp"
#include "devices/axis/motion_sequence.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/saved_position.hpp"
#include "devices/axis/start_wait.hpp"
#include "devices/axis/state_reader.hpp"

namespace axisd {

Task<> HomingSequence::run_home(ActivityPtr activity) {
  if (!co_await motion_.reach_standstill(activity)) co_return;
  const auto profile = context_.planner.homing();
  if (!profile || !*profile) {
    execution_.finish(*activity, [&](CommandRecord& command) {
      command.error(profile ? context_.error(Reason::not_supported, "no homing is configured")
                            : profile.error());
    });
    co_return;
  }
  if (shaft_.on_homing_switch()) {
    if (!co_await back_off(activity)) co_return;
    const auto now = context_.env.clock->now();
    starts_.start_by(activity, now, now + context_.settings.start_within);
  }

  // Before it can come true again: homing may end where the saved record says that the axis stood (M20).
  activity->start.save();
  auto forgotten = co_await saved_.forget_saved_position();
  if (!execution_.current(*activity)) co_return;
  activity->start.saved();
  if (!forgotten) {
    tell_part(*activity, forgotten.error());
    execution_.finish(*activity, [&](CommandRecord& command) { command.error(forgotten.error()); });
    co_return;
  }
  if (!co_await starts_.noted(activity, starts_.note_of(*activity, {}))) co_return;
  bool homed_before = false;
  std::int64_t base = 0;
  Result<void> result;
  {
    if (!co_await starts_.take_turn(activity)) co_return;
    const StateReader::Chain chain(reader_);
    if (activity->turn)
      result = co_await reader_.look(context_.settings.reboot_guard);  // it may have waited long
    if (!execution_.current(*activity) || !starts_.may_start(*activity)) co_return;
    if (result && shaft_.on_homing_switch()) result = axisd::fail(reached_switch());
    if (result) {
      readings_.lose_trust();
      homed_before = shaft_.sample()->homed;
      base = shaft_.tracker().counter();
      activity->number = stop_.unseen_start().sending(base, context_.env.clock->now());
      result = co_await context_.drive->start_homing(**profile, execution_.guard(*activity));
    }
  }
  result ? activity->turn.done() : activity->turn.leave();
  const auto since = context_.env.clock->now();
  if (!co_await motion_.started(activity, std::move(result), base, since)) co_return;
  if (co_await follow_homing(activity, since, homed_before)) co_await declare_home(activity);
}

/// The drive rests at home: the position there is the one that the configuration says.
Task<> HomingSequence::declare_home(ActivityPtr activity) {
  const auto position = context_.settings.homing->position;
  // Should the disk fail, the position holds for this run of the daemon; only a restart will not find it.
  const auto counter = counter_at_home();
  const auto offset = shaft_.tracker().offset_for(position) + shaft_.tracker().counter() - counter;
  (void)co_await saved_.journal_offset(offset, PositionTrust::homed);
  if (!execution_.current(*activity)) co_return saved_.correct_saved_position();
  if (shaft_.moved_from(counter)) {
    saved_.correct_saved_position();
    execution_.fail_with_stop(*activity,
                              context_.error(Reason::moving, "the axis moved after it had reached home",
                                             "check terminals, and other masters on the bus; home again"));
    co_return;
  }
  shaft_.tracker().declare(offset, PositionTrust::homed);
  execution_.finish(*activity, [](CommandRecord& command) { command.done(); });
}

/// The drive would search for an edge that is behind it.
Error HomingSequence::reached_switch() const {
  auto cause = context_.error(
      Reason::limit_switch,
      fmt::format("the {} switch became active before homing could start", context_.homing_switch()),
      "home again: it is left first then");
  cause.outcome = Outcome::not_executed;
  return cause;
}

/// Where the drive put its counter at home: a measured one only wavers about it. Which of the two it is after
/// a compensation is not said (7.5).
std::int64_t HomingSequence::counter_at_home() const {
  const auto measured = shaft_.tracker().counter();
  const auto turns = measured - shaft_.sample()->position_pulses;
  const auto home = turns, compensated = turns + context_.scale.to_pulses(context_.settings.homing->offset);
  const bool at_home = !shaft_.moved_from(home), at_compensated = !shaft_.moved_from(compensated);
  if (home != compensated && at_home && at_compensated) return measured;  // either may be meant
  if (at_home) return home;
  return at_compensated ? compensated : measured;
}

/// The drive searches for the rising edge of the switch; on an active switch there is none. A bounded move
/// against the search direction leaves it.
Task<bool> HomingSequence::back_off(ActivityPtr activity) {
  const auto method = context_.settings.homing->method;
  const bool search_positive =
      method == HomingMethod::home_positive || method == HomingMethod::positive_limit;
  const auto distance = *context_.settings.homing->backoff * (search_positive ? -1 : 1);
  const auto velocity =
      std::max(context_.settings.homing->search_velocity, context_.planner.minimum_velocity());
  auto plan =
      context_.planner.profile(velocity, {.acceleration_time = context_.settings.homing->acceleration_time});
  if (plan) {
    // Away from an active switch is right, wherever the software limits are.
    plan =
        context_.planner.aimed(*std::move(plan), shaft_.tracker().plan_relative(distance), shaft_.tracker());
  }
  if (!plan) {
    execution_.finish(*activity, [&](CommandRecord& command) { command.error(plan.error()); });
    co_return false;
  }
  activity->plan = *plan;
  if (!co_await motion_.positioned(activity)) co_return false;
  shaft_.tracker().forget_base();
  if (!shaft_.on_homing_switch()) co_return true;
  execution_.finish(*activity, [this](CommandRecord& command) {
    command.error(context_.error(
        Reason::limit_switch,
        fmt::format("the {} switch is still active after backing off", context_.homing_switch()),
        "check the switch, or configure a longer backoff"));
  });
  co_return false;
}

HomingMachine HomingSequence::followed_homing(TimePoint since, bool homed_before) const {
  const auto& homing = *context_.settings.homing;
  const auto fastest =  // pulses per second
      std::max(std::abs(context_.scale.velocity_to_rpm(homing.velocity)),
               std::abs(context_.scale.velocity_to_rpm(homing.search_velocity))) /
      60 * static_cast<double>(context_.settings.scale.pulses_per_revolution);
  return {{.since = since,
           .timeout = homing.timeout,
           .homed_before = homed_before,
           .offset_pulses = context_.scale.to_pulses(homing.offset),
           .window = context_.drive->position_window(),
           .fastest = fastest,
           .max_travel = homing.max_travel,
           .origin = shaft_.tracker().counter(),
           .asked_at = shaft_.sample()->asked_at},
          context_.scale};
}

/// True: the drive reports home. False: the activity has ended otherwise.
Task<bool> HomingSequence::follow_homing(ActivityPtr activity, TimePoint since, bool homed_before) {
  using State = HomingMachine::State;
  auto homing = followed_homing(since, homed_before);
  for (;;) {
    co_await shaft_.sampled().wait_until(
        std::max(homing.latest(), context_.env.clock->now() + milliseconds(1)));
    if (!execution_.current(*activity)) co_return false;
    const bool held_up = shaft_.input_active("stop") || shaft_.input_active("quick_stop");
    const auto state =
        homing.look({.sample = *shaft_.sample(), .counter = shaft_.tracker().counter(), .held_up = held_up},
                    context_.env.clock->now());
    if (state == State::home) co_return true;
    if (state <= State::settling) continue;
    execution_.fail_with_stop(*activity, not_homed(state));
    co_return false;
  }
}

/// Why homing has ended, or was ended, without reaching home.
Error HomingSequence::not_homed(HomingMachine::State state) const {
  switch (state) {
    case HomingMachine::State::did_not_start:
      return context_.error(Reason::did_not_start, "the drive accepted the homing command but does not home",
                            "check enable, alarm and terminals");
    case HomingMachine::State::too_far:
      return context_.error(
          Reason::not_reached,
          fmt::format("no switch within max_travel of {} {}; it is being stopped",
                      context_.settings.homing->max_travel.value_or(0), context_.settings.scale.unit),
          "check the switch and the homing direction");
    case HomingMachine::State::took_too_long:
      return context_.error(Reason::took_too_long, "no switch was found in time; it is being stopped",
                            "check the switch, or raise homing: { timeout: ... }");
    default:
      return context_.error(Reason::not_reached, "homing ended without reaching home",
                            "check the switch, limit and stop terminals");
  }
}

}  // namespace axisd
