// Nothing starts late (M31). Between the acceptance of a command and its first start frame lies at most
// `start_within`, by a clock that a paused process and a suspended computer do not stop; the deadline of its
// call, as it was known at acceptance, shortens that. The gate decides at the bind; what waits for something
// else than the line ends when the time is over.
// What counts from where:
// - A command that had to wait in the buffer: from its turn. The call's deadline says nothing of that. One
// that waited only for its axis to be enabled: from its arrival.
// - One that first has to end a motion (M9): a deceleration and `stop_margin` more, as the ramp is the
// drive's.
// - Homing that backs off first: each of its two starts on its own, the second from the end of the first.
// - A group: its members together, member.cpp. One that is to start at a moment: from that, however long
// ago it was accepted.
#include "devices/axis/start_wait.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/seconds.hpp"
#include "devices/axis/execution.hpp"

namespace axisd {

namespace {

/// Of the others none begins a motion, or gives power.
bool may_be_late(CommandKind kind) {
  return kind == CommandKind::disable || kind == CommandKind::reset || kind == CommandKind::set_position;
}

std::string_view to_string(StartMachine::State waits) {
  switch (waits) {
    case StartMachine::State::halting:
      return "for the motion before it to end";
    case StartMachine::State::noting:
    case StartMachine::State::saving:
      return "for the disk";
    case StartMachine::State::queued:
      return "for its turn on the line";
    default:
      return "for its line";
  }
}

}  // namespace

void StartWait::bound_start(const ActivityPtr& activity, bool waited, bool halting) {
  if (halting) activity->start.wait_for_halt();
  if (may_be_late(activity->command->value().kind)) return;
  const auto& options = activity->options;
  auto since = context_.env.clock->now();
  if (!waited && options.arrived != TimePoint{}) since = options.arrived;
  auto latest = since + context_.settings.start_within;
  if (halting) latest += stop_.deceleration() + context_.settings.stop_margin;
  if (halting && stop_.unseen_start().may_begin()) latest += start_window;  // so long its rest proves nothing
  if (!waited) latest = std::min(latest, options.call_deadline);
  start_by(activity, since, latest);
}

/// No start frame of the activity goes out after `latest`.
void StartWait::start_by(const ActivityPtr& activity, TimePoint since, TimePoint latest) {
  activity->waits_since = since;
  activity->start_by = latest;
  activity->late = context_.env.clock->call_at(latest + Duration(1), [this, weak = std::weak_ptr(activity)] {
    if (const auto waiting = weak.lock()) end_late(*waiting);
  });
}

/// What is with the bus is ended by its gate.
void StartWait::end_late(Activity& activity) {
  if (!activity.start.waits()) return;
  if (!execution_.current(activity)) return;
  execution_.revoke_motion();
  auto cause = late(activity, {});
  tell_part(activity, cause);
  execution_.finish(activity, [&](CommandRecord& command) { command.abort(std::move(cause)); });
}

Error StartWait::late(const Activity& activity, Error cause) const {
  const auto waited = context_.env.clock->now() - activity.waits_since;
  if (activity.start.state() == StartMachine::State::set_down)
    return context_.error(
        Reason::expired, fmt::format("it was prepared for {:.3f} s, and was not started", in_seconds(waited)),
        "prepare it again, and start it in time");
  auto told = context_.error(
      Reason::expired,
      fmt::format("too late to start: it waited {:.3f} s {}, at most {:.3f} s are allowed "
                  "(start_within{})",
                  in_seconds(waited), to_string(activity.start.state()),
                  in_seconds(activity.start_by - activity.waits_since),
                  activity.start_by == activity.options.call_deadline ? ", the call's deadline" : ""),
      "repeat it, if it is still wanted; if it is often so, look at the load of disk and line");
  if (!cause.where.bus.empty()) told.where = std::move(cause.where);
  return told;
}

/// By what a restart tells whether the activity's start was executed.
SendingNote StartWait::note_of(const Activity& activity, std::vector<ContinuityMark> marks) const {
  const auto raw = static_cast<std::int32_t>(shaft_.tracker().counter());
  SendingNote note{
      .start_pulses = raw, .tolerance_pulses = context_.target_tolerance(), .marks = std::move(marks)};
  if (activity.command->value().kind == CommandKind::home) {
    // Which way a compensation counts is the drive's business: one of both is enough to be careful.
    const auto offset =
        context_.scale.to_pulses(context_.settings.homing ? context_.settings.homing->offset : 0);
    note.target_pulses = static_cast<std::int32_t>((raw < 0) == (offset < 0) ? offset : -offset);
    if (const auto mark = context_.drive->continuity_mark(); mark && note.marks.empty()) note.marks = {*mark};
    return note;
  }
  if (activity.plan.target) note.target_pulses = static_cast<std::int32_t>(activity.plan.target->counter);
  return note;
}

/// Makes the command known to a restart, before anything is sent for it that may move. False: the activity
/// has ended, and nothing was sent.
Task<bool> StartWait::noted(ActivityPtr activity, SendingNote note) {
  if (!activity->start.note()) co_return true;
  // Shared: the answer may come after this sequence was left.
  auto answer = std::make_shared<Promise<Result<void>>>(context_.env.executor, *context_.env.clock);
  context_.env.book->sending(activity->command, std::move(note),
                             [answer](Result<void> result) { answer->set(std::move(result)); });
  const auto durable = co_await answer->get();
  if (!execution_.current(*activity)) co_return false;
  activity->start.noted();
  if (durable) co_return true;
  auto cause = context_.error(durable.error().reason, "nothing was sent: " + durable.error().message,
                              durable.error().remedy);
  cause.where.native_code = durable.error().where.native_code;
  execution_.finish(*activity, [&](CommandRecord& command) { command.error(std::move(cause)); });
  co_return false;
}

/// What was true at its acceptance, or before the disk was waited for, may have changed. False: the activity
/// has ended, and nothing was sent.
bool StartWait::may_start(Activity& activity) {
  const bool moved = shaft_.found_in_motion();
  if (!moved && (!activity.plan.trusted || shaft_.tracker().trust() != PositionTrust::unknown)) return true;
  auto cause = moved
                   ? context_.moved_before_start()
                   : context_.error(Reason::not_trusted, "the position was lost before the move could start",
                                    "home the axis, or set its position");
  tell_part(activity, cause);
  execution_.finish(activity, [&](CommandRecord& command) { command.error(std::move(cause)); });
  return false;
}

/// Lets others start that asked before; then nobody else does until the turn is left (M6). False: the
/// activity has ended, and nothing was sent.
Task<bool> StartWait::take_turn(ActivityPtr activity) {
  auto* turns = context_.env.bus->start_turns();
  if (turns == nullptr) co_return true;
  activity->start.queue();
  if (!activity->turn) activity->turn = turns->announce();
  co_await turns->take(activity->turn);
  if (!execution_.current(*activity)) co_return false;
  had_turn_ = context_.env.clock->now();
  activity->start.has_turn();
  co_return true;
}

/// What the gate no longer let out was overtaken by time or by another client: nobody's error.
void StartWait::end_unsent(Activity& activity, Error cause) {
  if (cause.reason == Reason::expired && context_.env.clock->now() > activity.start_by)
    cause = late(activity, cause);
  const bool aborted = cause.reason == Reason::expired || cause.reason == Reason::lease_lost;
  execution_.finish(activity,
                    [&](CommandRecord& command) { aborted ? command.abort(cause) : command.error(cause); });
}

}  // namespace axisd
