// From the acknowledged start of a motion to its end: MotionMachine and StartReadback judge the readings, and
// what follows from that is done here.
#include "devices/axis/motion_follower.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "devices/axis/drive_connection.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/state_reader.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

namespace {

/// So long after the predicted end it is looked for as fast as the bus can.
constexpr auto end_window = milliseconds(300);
/// And from so long before, at most, and a part of the way's time: a drive has a clock of its own.
constexpr Duration longest_end_lead = milliseconds(10);
constexpr int end_lead_share = 32;
/// So long after a start nothing is asked, at most, so that canaries come in time (M7).
constexpr Duration longest_quiet = milliseconds(100);
/// So long a proof at the target may take before its axis is read again.
constexpr Duration proof_patience = milliseconds(20);

void count(UnknownOutcomes& outcomes, StartReadback::State state) {
  if (state == StartReadback::State::executed)
    ++outcomes.executed;
  else if (state == StartReadback::State::not_executed)
    ++outcomes.not_executed;
  else
    ++outcomes.unresolved;
}

/// A measured shaft that is elsewhere than at `base` may only settle there from the motion before: it has
/// come to this target where it is there, and nearer to it than to `base`.
bool has_come(std::int64_t counter, std::int64_t base, std::int64_t target, std::int64_t tolerance) {
  const auto left = std::abs(target - counter);
  return left <= tolerance && left < std::abs(counter - base);
}

}  // namespace

/// When a motion was read at rest at its target, and not too fast, by the drive that began it. Nothing: the
/// activity has ended otherwise.
Task<std::optional<TimePoint>> MotionFollower::arrived(ActivityPtr activity, std::int64_t base,
                                                       TimePoint since) {
  activity->motion = followed(activity->plan, base, since);
  for (;; activity->motion->go_on()) {
    if (!co_await follow(activity, base, since)) co_return std::nullopt;
    const auto when = shaft_.sample()->measured_at;
    if (!co_await is_no_reboot(activity)) co_return std::nullopt;
    // While its proof was waited for a terminal may have begun another motion.
    if (shaft_.sample()->moving || shaft_.sample()->mode != DriveMode::positioning ||
        !shaft_.is_at(*activity->plan.target))
      continue;
    if (readings_.watch_speed(SpeedWatch::Event::arrived)) co_return std::nullopt;
    co_return when;
  }
}

/// A drive that was restarted, on the way or before, shows the counter 0: only where the reading at the
/// target could be that, too, it has to prove that it is the same one.
Task<bool> MotionFollower::is_no_reboot(ActivityPtr activity) {
  if (shaft_.sample() && context_.drive->rules_out_restart(*shaft_.sample())) {
    // Else the canary would seem to be due, and a reading beside it would wait for the next start's place.
    if (const auto proven = context_.drive->proven_at()) reader_.continuity().proven(*proven);
    co_return true;
  }
  reader_.keep_quiet(context_.env.clock->now() +
                     std::min<Duration>(context_.settings.poll_moving, proof_patience));
  co_return co_await proven_continuous(activity);
}

/// Nothing was sent, as the axis rested at its target when it was read: what a terminal did since is looked
/// for before it is called Done. False: the activity has ended.
Task<bool> MotionFollower::still_there(ActivityPtr activity) {
  if (!context_.may_move_by_itself()) co_return true;
  const auto since = context_.env.clock->now();
  while (!shaft_.sample() || shaft_.sample()->asked_at < since) {
    reader_.wake();
    co_await shaft_.sampled().wait_until(context_.env.clock->now() + milliseconds(50));
    if (!execution_.current(*activity)) co_return false;  // offline, too
  }
  if (!shaft_.found_in_motion() && shaft_.is_at(*activity->plan.target)) co_return true;
  auto cause = context_.error(Reason::moving, "the shaft was moved while the axis rested at its target",
                              "see what moves it; then repeat the move");
  cause.outcome = Outcome::not_executed;
  tell_part(*activity, cause);
  execution_.finish(*activity, [&](CommandRecord& command) { command.error(std::move(cause)); });
  co_return false;
}

/// The drive was not restarted since its parameters were last written: the canary is read until it answers.
/// False: the activity has ended.
Task<bool> MotionFollower::proven_continuous(ActivityPtr activity) {
  Result<void> proof;
  do {
    proof = co_await reader_.prove_continuity(TransactionClass::moving_state);
    if (!execution_.current(*activity)) co_return false;  // offline, too
  } while (!proof && proof.error().reason == Reason::no_reply);
  if (proof) co_return true;
  if (proof.error().reason == Reason::rebooted) {
    connection_.on_reboot(proof.error());
  } else {
    auto cause = proof.error();
    cause.outcome = Outcome::unknown;
    execution_.fail_with_stop(*activity, std::move(cause));
  }
  co_return false;
}

/// What became of a trigger that was sent, and got no reply that says so. True: it was executed.
Task<bool> MotionFollower::read_back(ActivityPtr activity, Error cause, std::int64_t base, TimePoint since) {
  using State = StartReadback::State;
  StartReadback readback(since);
  while (readback.state() == State::reading) {
    reader_.wake();
    co_await shaft_.sampled().wait_until(
        std::max(readback.deadline(), context_.env.clock->now() + milliseconds(50)));
    if (!execution_.current(*activity)) {  // offline, too: then the command has ended as unknown
      readback.superseded();
      break;
    }
    readback.look(readback_of(base), context_.env.clock->now());
  }
  // Its standstill is no proof: a restart would have ended a motion, too.
  const bool proven = readback.state() == State::resting && co_await proven_continuous(activity);
  // Proven continuous, it did not start; unless a pulse at a terminal, between two readings, ended the motion
  // as it began, or took the shaft back, or it rests where it would have arrived, or elsewhere than it was.
  const bool terminals_may_hide_it = context_.terminals.may_start_motion() ||
                                     context_.terminals.has("motor_free") || context_.terminals.has("stop") ||
                                     context_.terminals.has("quick_stop");
  const bool moves_to_a_target = activity->state != AxisState::homing && !activity->plan.endless;
  const auto is_at_target = [&] {
    return std::abs(shaft_.tracker().counter() - activity->plan.target->counter) <=
           context_.drive->position_window();
  };
  if (proven)
    readback.proven(!terminals_may_hide_it && !shaft_.moved_from(base) &&
                    !(moves_to_a_target && is_at_target()));
  else if (readback.state() == State::resting)
    readback.superseded();
  count(unknown_starts_, readback.state());
  if (readback.state() == State::executed) {
    activity->command->activate();
    publisher_.publish();
    co_return true;
  }
  if (!proven) co_return false;
  if (readback.state() == State::not_executed) {
    cause.outcome = Outcome::not_executed;
    cause.message =
        fmt::format("{}: the start frame {}, and the drive did not move: {}", context_.settings.name,
                    cause.reason == Reason::refused ? "was refused" : "got no reply", cause.message);
    tell_part(*activity, cause);
  }
  execution_.fail_with_stop(*activity, std::move(cause));
  co_return false;
}

/// What the newest reading says of the activity's start from `base`. Precondition: there is an activity.
std::optional<StartReadback::Reading> MotionFollower::readback_of(std::int64_t base) const {
  if (!shaft_.sample()) return std::nullopt;
  const auto& target = execution_.activity()->plan.target;
  const bool certain =
      context_.drive->position_window() == 0 ||
      (target && has_come(shaft_.tracker().counter(), base, target->counter, context_.target_tolerance()));
  return StartReadback::Reading{.asked_at = shaft_.sample()->asked_at,
                                .shows_it = shaft_.sample()->moving || (certain && shaft_.moved_from(base)) ||
                                            shaft_.sample()->mode != DriveMode::positioning};
}

/// A position tells that the motion was executed. Where its drive takes it for arrived it may still be that
/// window short of its target (M30).
bool MotionFollower::shows(const Plan& plan, std::int64_t base) const {
  const auto window = context_.drive->position_window();
  return window == 0 || std::abs(plan.target->counter - base) > 2 * window;
}

/// At rest, and not at the target.
bool MotionFollower::held_back(const Plan& plan) const {
  return shaft_.limit_active(plan.positive) || shaft_.input_active("stop") ||
         shaft_.input_active("quick_stop");
}

/// When a motion is read that was acknowledged at `since`: its end is to be told at once, and before it has
/// something to tell the line is left to others.
void MotionFollower::expect_end(const Plan& plan, std::int64_t base, TimePoint since) {
  reader_.pace().came();
  // Of a way that its position does not tell only a reading in motion does: else its end is waited for long.
  if (!plan.endless && !shows(plan, base))
    return reader_.poll_fast(since, std::max(plan.predicted, start_window) + end_window);
  if (!plan.endless) {
    const auto soonest = context_.planner.soonest(plan, plan.target->counter - base);
    const auto lead = std::min(soonest / end_lead_share, longest_end_lead);
    reader_.poll_for_end(since + soonest - lead, plan.predicted - soonest + lead + end_window);
  }
  reader_.keep_quiet(std::min(reader_.pace().next(since, true), since + longest_quiet));
  // What the poll loop asked for before the start would come too early, and keep the next one waiting.
  context_.env.bus->give_up_readings(context_.settings.node);
}

MotionMachine MotionFollower::followed(const Plan& plan, std::int64_t base, TimePoint since) const {
  return MotionMachine({.since = since,
                        .predicted = plan.predicted,
                        .endless = plan.endless,
                        .unseen = !plan.endless && !shows(plan, base),
                        .settling = context_.settling()});
}

/// What the newest reading says of a motion by that plan, from `base`. Precondition: there is one.
MotionMachine::Reading MotionFollower::reading_of(const Plan& plan, std::int64_t base) const {
  const bool certain = context_.drive->position_window() == 0 || held_back(plan) ||
                       (plan.target && has_come(shaft_.tracker().counter(), base, plan.target->counter,
                                                context_.target_tolerance()));
  return {.asked_at = shaft_.sample()->asked_at,
          .positioning = shaft_.sample()->mode == DriveMode::positioning,
          .moving = shaft_.sample()->moving,
          .elsewhere = certain && shaft_.moved_from(base),
          .at_target = !plan.endless && shaft_.is_at(*plan.target),
          .near_target = !plan.endless && shaft_.is_near(*plan.target),
          .beside = !plan.endless && shaft_.moved_from(base) && !shaft_.is_at(*plan.target),
          .in_position = context_.drive->position_window() == 0 || shaft_.sample()->in_position,
          .held_back = held_back(plan),
          .astray = is_astray(plan, base)};
}

/// The drive executes another motion, such as the one that this one replaced: the shaft is behind `base`, or
/// beyond the target, by more than it settles or is turned as it is taken hold of.
bool MotionFollower::is_astray(const Plan& plan, std::int64_t base) const {
  const auto margin =
      std::max(context_.settings.scale.pulses_per_revolution / 8, 8 * context_.drive->position_window());
  const auto way = plan.endless ? 0 : plan.target->counter - base;
  const bool positive = plan.endless ? plan.positive != context_.settings.scale.invert : way > 0;
  const auto gone = positive ? shaft_.tracker().counter() - base : base - shaft_.tracker().counter();
  return gone < -margin || (!plan.endless && gone > std::abs(way) + margin);
}

/// Watches a motion until it ends. True: it rests at the plan's target. False: the activity has ended
/// otherwise. Precondition: the activity has a motion.
Task<bool> MotionFollower::follow(ActivityPtr activity, std::int64_t base, TimePoint since) {
  using State = MotionMachine::State;
  const auto& plan = activity->plan;
  auto& motion = *activity->motion;
  expect_end(plan, base, since);
  for (;;) {
    const auto deadline = std::min(activity->hold_until.value_or(motion.latest()), motion.latest());
    co_await shaft_.sampled().wait_until(std::max(deadline, context_.env.clock->now() + milliseconds(20)));
    if (!execution_.current(*activity)) co_return false;
    if (activity->hold_until && context_.env.clock->now() >= *activity->hold_until) {
      end_hold(*activity);
      co_return false;
    }
    if (!shaft_.sample()) continue;
    auto reading = reading_of(plan, base);
    if (reading.asked_at >= since + start_window)
      reading.elsewhere = shaft_.moved_from(base);  // nothing settles so long
    const auto state = motion.look(reading);
    if (state <= State::settling) continue;
    reader_.pace().came();
    if (state == State::arrived) co_return true;
    end_motion(*activity, state);
    co_return false;
  }
}

/// Nobody has renewed the hold of a jog, or of a held velocity.
void MotionFollower::end_hold(Activity& activity) {
  execution_.note_motion_to_stop();
  execution_.revoke_motion();
  execution_.leave_running(activity);
  stopper_.begin_stop(StopKind::halt, nullptr);
  auto cause = context_.error(Reason::expired, "the hold was not renewed in time",
                              "repeat the call within its hold time");
  execution_.finish(activity, [&](CommandRecord& command) { command.abort(std::move(cause)); });
}

/// It has not arrived.
void MotionFollower::end_motion(Activity& activity, MotionMachine::State state) {
  switch (state) {
    case MotionMachine::State::taken_over:
      return execution_.fail_with_stop(
          activity, context_.error(Reason::terminal, "a terminal of the drive took over the motion",
                                   "check the terminals"));
    case MotionMachine::State::astray:
      return execution_.fail_with_stop(
          activity,
          context_.error(Reason::not_reached, "the drive moves away from its target, and is being stopped",
                         "look at the machine; check load, tuning, and other masters on the bus"));
    case MotionMachine::State::did_not_start:
      return execution_.fail_with_stop(
          activity, context_.error(Reason::did_not_start, "the drive accepted the start but does not move",
                                   "check limit and stop terminals, enable and alarm"));
    case MotionMachine::State::took_too_long:
      return execution_.fail_with_stop(
          activity, context_.error(Reason::took_too_long, "the motion takes longer than predicted; stopped",
                                   "check the load, and other masters on the bus"));
    default:
      return end_at_rest(activity);
  }
}

/// The drive rests, but not at the target: says why, and ends the activity.
void MotionFollower::end_at_rest(Activity& activity) {
  const auto positive = activity.plan.positive;
  if (shaft_.limit_active(positive)) {
    if (!context_.drive->closed_loop()) readings_.lose_trust();  // the overtravel stop has no ramp (M20)
    return execution_.abort_at_rest(
        activity, context_.error(
                      Reason::limit_switch,
                      fmt::format("the {} limit switch ended the motion", positive ? "positive" : "negative"),
                      "move away from it; home the axis"));
  }
  const bool terminal = shaft_.input_active("stop") || shaft_.input_active("quick_stop");
  // Without a ramp an open loop may have lost steps (M20). A short pulse at a terminal, or another master,
  // leaves nothing by which to tell the kind of stop.
  if (!context_.drive->closed_loop() && !shaft_.input_active("stop")) readings_.lose_trust();
  if (terminal)
    return execution_.abort_at_rest(
        activity, context_.error(Reason::terminal, "a stop terminal of the drive ended the motion",
                                 "check the terminals"));
  const auto& target = activity.plan.target;
  const auto short_of = target ? std::abs(shaft_.tracker().counter() - target->counter) : std::int64_t{0};
  auto cause = context_.error(Reason::not_reached,
                              fmt::format("the drive came to rest at {:.6g} {}", shaft_.tracker().position(),
                                          context_.settings.scale.unit),
                              "check terminals, and other masters on the bus");
  // The loop gives an alarm where it is further off; what ended the motion on its way is mostly further, too.
  if (context_.drive->closed_loop() && target && short_of < context_.settings.scale.pulses_per_revolution) {
    cause.message += fmt::format(", {:.3g} {} from its target",
                                 static_cast<double>(short_of) / std::abs(context_.scale.pulses_per_unit()),
                                 context_.settings.scale.unit);
    cause.remedy =
        fmt::format(
            "check what holds or loads the shaft, the drive's current, and its tuning if the shaft takes "
            "longer than {} ms to settle; a larger position_tolerance permits more; else ",
            context_.settling() / milliseconds(1)) +
        cause.remedy;
  }
  execution_.fail_with_stop(activity, std::move(cause));
}

}  // namespace axisd
