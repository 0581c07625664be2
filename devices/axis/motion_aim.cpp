// Where a motion starts from, and where it goes: judged as shortly before the trigger as it takes (M19).
#include "devices/axis/motion_aim.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/axis/execution.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/saved_position.hpp"
#include "devices/axis/state_reader.hpp"

namespace axisd {

namespace {

/// A counter that was told to become zero shows it within this.
constexpr auto zeroing_window = milliseconds(200);
constexpr auto zeroing_poll = milliseconds(5);

}  // namespace

/// Plans the activity's motion anew, from where the shaft is: the counter may mean something else since it
/// was accepted (homing, SetPosition, zeroing), and the shaft may have been moved (M19). Errors: as of
/// Planner::move().
Result<void> MotionAim::aim(Activity& activity) {
  auto& plan = activity.plan;
  shaft_.tracker().settle_base();
  const auto velocity = plan.granted.velocity;
  const auto& command = activity.command->value();
  auto target = shaft_.tracker().again(*plan.target);
  // The shorter way round is that from where the axis rests.
  if (command.kind == CommandKind::move_absolute && context_.settings.scale.modulo)
    target =
        context_.target_of({.position = command.asked.position.value_or(target.position)}, shaft_.tracker());
  // What backs off from a switch before homing is bounded by itself.
  if (activity.state == AxisState::homing) {
    plan = context_.planner.aimed(std::move(plan), target, shaft_.tracker());
    return {};
  }
  auto aimed = context_.planner.move(plan, target, shaft_.tracker());
  if (!aimed) return fail(aimed.error());
  if (auto way = check_direction(activity, target); !way) return way;
  plan = *std::move(aimed);
  plan.granted.velocity = velocity;  // with its sign
  activity.command->grant(plan.granted);
  return {};
}

/// A velocity that ends at a limit never leads back to it. Errors: soft_limit.
Result<void> MotionAim::check_direction(const Activity& activity,
                                        const PositionTracker::Target& target) const {
  const auto& velocity = activity.plan.granted.velocity;
  if (activity.state != AxisState::continuous_motion || !velocity || shaft_.tracker().rests_at(target) ||
      context_.planner.positive(target, shaft_.tracker()) == (*velocity > 0))
    return {};
  return fail(context_.error(Reason::soft_limit, "beyond the software limit already", "move the other way"));
}

/// The drive would go as far as was asked (M19), and the way that was asked for. Errors: moving, soft_limit.
Result<void> MotionAim::check_way(const Activity& activity) const {
  const auto& plan = activity.plan;
  if (auto way = check_direction(activity, *plan.target); !way) return way;
  if (shaft_.tracker().deviation(*plan.target) <= context_.drive->position_window() + 1) return {};
  return fail(context_.error(
      Reason::moving,
      fmt::format("the shaft was moved before the start: from {:.6g} {} the way would be another "
                  "than the one that was asked for",
                  shaft_.tracker().position(), context_.settings.scale.unit),
      "see what moves it; then repeat the move"));
}

/// Zeroes the drive's counter before a target could leave its 32 bit, or what the drive takes (M19).
Task<Result<void>> MotionAim::make_room(ActivityPtr activity) {
  if (context_.planner.reachable(activity->plan.target->counter)) co_return Result<void>{};
  // After it the saved record speaks of another zero, and would fit again where the counter comes by (M20).
  activity->start.save();
  if (auto forgotten = co_await saved_.forget_saved_position(); !forgotten) co_return forgotten;
  if (!execution_.current(*activity)) co_return fail(context_.error(Reason::superseded, "superseded"));
  activity->start.saved();
  // Not before: who waits for the disk is looked after meanwhile.
  const StateReader::Chain chain(reader_);
  // A sample that was asked for meanwhile may show either counter: none is taken for a motion.
  shaft_.watch().begin_rezeroing();
  auto cleared = co_await context_.drive->clear_position(execution_.guard(*activity));
  // Without a reply it may have been cleared: the counter tells, and clearing it twice changes nothing.
  if (!cleared && cleared.error().outcome != Outcome::unknown) {
    shaft_.watch().end_rezeroing();
    co_return cleared;
  }
  const bool zero = co_await counter_shows_zero();
  shaft_.watch().end_rezeroing();
  if (zero) {
    shaft_.tracker().rezero(0);
    activity->plan.target = shaft_.tracker().again(*activity->plan.target);
    co_return Result<void>{};
  }
  // It may become zero at any time, which would look like a motion.
  readings_.lose_trust();
  shaft_.tracker().forget_base();
  auto cause = context_.error(Reason::not_confirmed, "the drive's position counter could not be zeroed",
                              "repeat the move");
  cause.outcome = Outcome::not_executed;
  co_return fail(std::move(cause));
}

/// When an acknowledged zeroing shows is not said. The poll rests meanwhile, so what these samples tell is
/// heard here. Goes on when superseded: what the counter means has to be known all the same.
Task<bool> MotionAim::counter_shows_zero() {
  const auto latest = context_.env.clock->now() + zeroing_window;
  for (;;) {
    const auto sample = co_await context_.drive->read_state(TransactionClass::motion);
    if (sample) {
      readings_.on_sample(*sample);
      if (sample->moving) co_return false;
      if (std::abs(std::int64_t{sample->position_pulses}) <= context_.drive->position_window())
        co_return true;
    }
    if (context_.env.clock->now() >= latest) co_return false;
    co_await sleep_until(context_.env.executor, *context_.env.clock,
                         context_.env.clock->now() + zeroing_poll);
  }
}

}  // namespace axisd
