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
// - A group: its members together, axis_group.cpp. One that is to start at a moment: from that, however long
// ago it was accepted.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/seconds.hpp"
#include "devices/axis/axis.hpp"

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

/// It arrived longer ago than it may wait, or its caller has given up. What is buffered may wait.
bool Axis::too_late(const CommandOptions& options) const {
  if (options.buffer_mode == BufferMode::buffered && (buffer_.starts() || activity_)) return false;
  const auto now = context_.env.clock->now();
  return now > options.call_deadline ||
         (options.arrived != TimePoint{} && now > options.arrived + context_.settings.start_within);
}

void Axis::bound_start(const ActivityPtr& activity, bool waited, bool halting) {
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
void Axis::start_by(const ActivityPtr& activity, TimePoint since, TimePoint latest) {
  activity->waits_since = since;
  activity->start_by = latest;
  activity->late = context_.env.clock->call_at(latest + Duration(1), [this, weak = std::weak_ptr(activity)] {
    if (const auto waiting = weak.lock()) end_late(*waiting);
  });
}

/// What is with the bus is ended by its gate.
void Axis::end_late(Activity& activity) {
  if (!activity.start.waits()) return;
  if (!current(activity)) return;
  revoke_motion();
  auto cause = late(activity, {});
  tell_part(activity, cause);
  finish(activity, [&](CommandRecord& command) { command.abort(std::move(cause)); });
}

/// Nothing was sent for it, as it would have been too late. `cause`: where that was found.
Error Axis::late(const Activity& activity, Error cause) const {
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

}  // namespace axisd
