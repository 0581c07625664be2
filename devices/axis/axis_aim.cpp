// Where a motion starts from, and where it goes: judged as shortly before the trigger as it takes (M19).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/axis/axis.hpp"
#include "devices/axis/chain.hpp"

namespace axisd {

/// Reads the drive's state, unless the last reading is not older than `oldest`. Errors: as of
/// Drive::read_state().
Task<Result<void>> Axis::look(Duration oldest) {
  constexpr int attempts = 3;
  if (shaft_.sample() && shaft_.sample()->asked_at >= context_.env.clock->now() - oldest)
    co_return Result<void>{};
  const Chain chain(*this);
  for (int attempt = 1;; ++attempt) {
    const auto sample = co_await context_.drive->read_state(TransactionClass::motion);
    auto seen = sample ? Result<void>{} : fail(sample.error());
    // What a restart leaves behind must not be taken for a release, or for a shaft that was turned.
    if (sample && shaft_.looks_restarted(*sample)) seen = co_await prove_continuity(TransactionClass::motion);
    if (seen) {
      on_sample(*sample);
      co_return seen;
    }
    if (seen.error().reason != Reason::no_reply || attempt == attempts) {
      seen.error().outcome = Outcome::not_executed;  // only read
      co_return seen;
    }
  }
}

/// Plans the activity's motion anew, from where the shaft is: the counter may mean something else since it
/// was accepted (homing, SetPosition, zeroing), and the shaft may have been moved (M19). Errors: as of
/// Planner::move().
Result<void> Axis::aim(Activity& activity) {
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
Result<void> Axis::check_direction(const Activity& activity, const PositionTracker::Target& target) const {
  const auto& velocity = activity.plan.granted.velocity;
  if (activity.state != AxisState::continuous_motion || !velocity || shaft_.tracker().rests_at(target) ||
      context_.planner.positive(target, shaft_.tracker()) == (*velocity > 0))
    return {};
  return fail(context_.error(Reason::soft_limit, "beyond the software limit already", "move the other way"));
}

/// The drive would go as far as was asked (M19), and the way that was asked for. Errors: moving, soft_limit.
Result<void> Axis::check_way(const Activity& activity) const {
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

/// Starts the activity's move from where the shaft was seen within the last `reboot_guard`, all but the
/// trigger being in the drive already. nullopt: the activity has ended, and nothing was sent.
Task<std::optional<Result<void>>> Axis::start_unmoved(ActivityPtr activity) {
  constexpr int attempts = 3;
  auto loaded = co_await context_.drive->load_move(profile_of(activity->plan), guard(*activity));
  if (!loaded) co_return fail(loaded.error());
  for (int attempt = 1;; ++attempt) {
    if (auto seen = co_await look(Duration{0}); !seen) co_return seen;
    if (!current(*activity) || !may_start(*activity)) co_return std::nullopt;
    if (auto way = check_way(*activity); !way) co_return way;
    activity->number = stop_.unseen_start().sending(shaft_.tracker().counter(), context_.env.clock->now());
    const auto triggered =
        co_await (*loaded)->trigger(shaft_.sample()->asked_at + context_.settings.reboot_guard);
    if (triggered) {
      co_await (*loaded)->follow_up();
      co_return Result<void>{};
    }
    const bool grown_old =
        triggered.error().reason == Reason::expired && context_.env.clock->now() < guard(*activity).not_after;
    if (!grown_old || attempt == attempts) co_return fail(triggered.error());
  }
}

}  // namespace axisd
