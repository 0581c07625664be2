// Sequences. Each reads top to bottom; after every wait it asks whether it is still current, and leaves if
// not.
#include "devices/axis/motion_sequence.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/axis/axis_log.hpp"
#include "devices/axis/drive_connection.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/power_sequence.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/saved_position.hpp"
#include "devices/axis/start_wait.hpp"
#include "devices/axis/state_reader.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

/// Lets a halt in progress end. False: no longer current.
Task<bool> MotionSequence::reach_standstill(ActivityPtr activity) {
  while (stopper_.machine().under_way() && execution_.current(*activity)) co_await stopper_.stopped().wait();
  if (!execution_.current(*activity)) co_return false;
  if (execution_.fault()) {
    execution_.finish(*activity, [this](CommandRecord& command) { command.error(*execution_.fault()); });
    co_return false;
  }
  activity->start.standstill();
  co_return true;
}

Task<> MotionSequence::run_move(ActivityPtr activity) {
  if (!co_await positioned(activity)) co_return;
  shaft_.tracker().reached(*activity->plan.target, context_.drive->position_window());
  saved_.remember_position();
  execution_.finish(*activity, [](CommandRecord& command) { command.done(); });
}

/// One positioning motion to the plan's target. False: the activity has ended.
Task<bool> MotionSequence::positioned(ActivityPtr activity) {
  if (!co_await reach_standstill(activity)) co_return false;
  auto result = co_await reader_.look(context_.settings.reboot_guard);
  if (!execution_.current(*activity) || !starts_.may_start(*activity)) co_return false;
  if (result) result = aim_.aim(*activity);
  if (result) result = co_await aim_.make_room(activity);
  if (!execution_.current(*activity)) co_return false;
  if (result &&
      !co_await starts_.noted(
          activity, starts_.note_of(*activity, context_.drive->marks_until(profile_of(activity->plan)))))
    co_return false;
  std::int64_t base = 0;
  bool there = false;
  {
    if (result && !co_await starts_.take_turn(activity)) co_return false;
    const StateReader::Chain chain(reader_);
    if (result) result = co_await reader_.look(context_.settings.reboot_guard);
    if (!execution_.current(*activity) || !starts_.may_start(*activity)) co_return false;
    if (result) result = aim_.check_way(*activity);
    base = shaft_.tracker().counter();
    const auto& target = *activity->plan.target;
    there = result && shaft_.tracker().rests_at(target);
    if (result && !there) {
      activity->plan.predicted = context_.planner.duration(activity->plan, target.counter - base);
      if (context_.may_move_by_itself()) {
        auto triggered = co_await start_unmoved(activity);
        if (!triggered) {
          stopper_.machine().unseen_start().not_sent(activity->number);
          co_return false;
        }
        result = *std::move(triggered);
        base = shaft_.tracker().counter();
      } else {
        activity->number = stopper_.machine().unseen_start().sending(base, context_.env.clock->now());
        result = co_await context_.drive->start_move(profile_of(activity->plan), execution_.guard(*activity));
      }
      if (result || result.error().outcome == Outcome::unknown) shaft_.tracker().forget_base();
    }
  }
  result && !there ? activity->turn.done() : activity->turn.leave();
  const auto since = context_.env.clock->now();
  if (there) {  // nothing to do, and nothing is sent
    activity->command->activate();
    co_return co_await follower_.is_no_reboot(activity) && co_await follower_.still_there(activity);
  }
  if (!co_await started(activity, std::move(result), base, since)) co_return false;
  co_return (co_await follower_.arrived(activity, base, since)).has_value();
}

Task<> MotionSequence::run_velocity(ActivityPtr activity) {
  if (!activity->plan.endless) {
    // Without a known position a jog is bounded by its travel alone: from where the shaft is (M16).
    if (activity->plan.target->distance) shaft_.tracker().forget_base();
    if (!co_await positioned(activity)) co_return;
    shaft_.tracker().reached(*activity->plan.target, context_.drive->position_window());
    saved_.remember_position();
    const bool jog = activity->command->value().kind == CommandKind::jog;
    const auto& limits = context_.settings.limits;
    const auto left = activity->plan.positive ? *limits.position_maximum - shaft_.tracker().position()
                                              : shaft_.tracker().position() - *limits.position_minimum;
    const bool short_of_it =
        context_.scale.to_pulses(left) * (context_.scale.pulses_per_unit() < 0 ? -1 : 1) >
        context_.target_tolerance() + 1;
    auto cause =
        short_of_it ? context_.error(Reason::out_of_range,
                                     "reached the end of the drive's longest single motion", "start it again")
                    : context_.error(Reason::soft_limit, "reached the software limit", "move the other way");
    execution_.finish(
        *activity, [&](CommandRecord& command) { jog ? command.done() : command.abort(std::move(cause)); });
    co_return;
  }
  if (!co_await reach_standstill(activity)) co_return;
  const VelocityProfile profile{.velocity_rpm = activity->plan.velocity_rpm,
                                .start_rpm = activity->plan.start_rpm,
                                .acceleration_time = activity->plan.acceleration_time,
                                .deceleration_time = activity->plan.deceleration_time};
  if (!co_await starts_.noted(activity, starts_.note_of(*activity, context_.drive->marks_until(profile))))
    co_return;
  Result<void> result;
  std::int64_t base = 0;
  {
    if (!co_await starts_.take_turn(activity)) co_return;
    const StateReader::Chain chain(reader_);
    if (activity->turn)
      result = co_await reader_.look(context_.settings.reboot_guard);  // it may have waited long
    if (!execution_.current(*activity) || !starts_.may_start(*activity)) co_return;
    base = shaft_.tracker().counter();
    if (result) {
      activity->number = stopper_.machine().unseen_start().sending(base, context_.env.clock->now());
      result = co_await context_.drive->start_velocity(profile, execution_.guard(*activity));
    }
  }
  result ? activity->turn.done() : activity->turn.leave();
  const auto since = context_.env.clock->now();
  if (!co_await started(activity, std::move(result), base, since)) co_return;
  activity->motion = follower_.followed(activity->plan, base, since);
  co_await follower_.follow(activity, base, since);
}

/// What became of a start. True: it was executed. A trigger of which the reply does not say so is never sent
/// again: the drive is read back until it shows what it did (M8).
Task<bool> MotionSequence::started(ActivityPtr activity, Result<void> result, std::int64_t base,
                                   TimePoint since) {
  const bool sent = result || result.error().outcome == Outcome::unknown;
  if (sent)
    stopper_.machine().unseen_start().sent(activity->number, since);
  else
    stopper_.machine().unseen_start().not_sent(activity->number);
  if (!execution_.current(*activity)) co_return false;
  if (sent) activity->start.begun();
  readings_.watch_speed(SpeedWatch::Event::begun);
  if (result) {
    // A proof was part of it, no longer than `reboot_guard` before the trigger; that has its reply since.
    reader_.continuity().proven(
        context_.drive->proven_at().value_or(since - 2 * context_.settings.reboot_guard));
    activity->command->activate();
    publisher_.publish();
    co_return true;
  }
  auto cause = result.error();
  if (cause.reason == Reason::rebooted) {
    connection_.on_reboot(cause);
    co_return false;
  }
  if (cause.reason == Reason::terminal) {
    power_sequence_.on_turned_by_power(cause);
    co_return false;
  }
  if (cause.outcome != Outcome::unknown) {
    tell_part(*activity, cause);
    starts_.end_unsent(*activity, cause);
    co_return false;
  }
  co_return co_await follower_.read_back(activity, std::move(cause), base, since);
}

/// Starts the activity's move from where the shaft was seen within the last `reboot_guard`, all but the
/// trigger being in the drive already. nullopt: the activity has ended, and nothing was sent.
Task<std::optional<Result<void>>> MotionSequence::start_unmoved(ActivityPtr activity) {
  constexpr int attempts = 3;
  auto loaded = co_await context_.drive->load_move(profile_of(activity->plan), execution_.guard(*activity));
  if (!loaded) co_return fail(loaded.error());
  for (int attempt = 1;; ++attempt) {
    if (auto seen = co_await reader_.look(Duration{0}); !seen) co_return seen;
    if (!execution_.current(*activity) || !starts_.may_start(*activity)) co_return std::nullopt;
    if (auto way = aim_.check_way(*activity); !way) co_return way;
    activity->number =
        stopper_.machine().unseen_start().sending(shaft_.tracker().counter(), context_.env.clock->now());
    const auto triggered =
        co_await (*loaded)->trigger(shaft_.sample()->asked_at + context_.settings.reboot_guard);
    if (triggered) {
      co_await (*loaded)->follow_up();
      co_return Result<void>{};
    }
    const bool grown_old = triggered.error().reason == Reason::expired &&
                           context_.env.clock->now() < execution_.guard(*activity).not_after;
    if (!grown_old || attempt == attempts) co_return fail(triggered.error());
  }
}

Task<> MotionSequence::run_member(ActivityPtr activity, std::int64_t base, TimePoint since, bool there,
                                  std::shared_ptr<std::optional<TimePoint>> arrival) {
  if (there) {
    if (!co_await follower_.is_no_reboot(activity) || !co_await follower_.still_there(activity)) co_return;
  } else {
    const auto when = co_await follower_.arrived(activity, base, since);
    if (!when) co_return;
    *arrival = when;
  }
  shaft_.tracker().reached(*activity->plan.target, context_.drive->position_window());
  saved_.remember_position();
  execution_.finish(*activity, [](CommandRecord& command) { command.done(); });
}

}  // namespace axisd
