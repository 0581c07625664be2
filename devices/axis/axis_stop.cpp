// Stopping: one sequence per axis sends, confirms and escalates (M12 to M14).
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/axis/axis.hpp"
#include "devices/axis/axis_log.hpp"

namespace axisd {

namespace {

/// A stop without a reply is repeated at once, this often before the motor's state decides.
constexpr int stop_attempts = 3;
/// Standstill that no stop was acknowledged before is looked at so often, with further attempts each time:
/// what rests by itself is not what was asked for. After that the drive simply does not acknowledge.
constexpr int unacknowledged_rounds = 4;

}  // namespace

void Axis::revoke_motion() {
  gate_->raise();
  env_.bus->purge_superseded(settings_.node, *gate_);
}

/// Ends what is being executed. Nothing that was prepared for it is sent any more.
void Axis::supersede(const Error& cause) {
  ++accept_epoch_;
  revoke_motion();
  if (auto activity = take_activity()) {
    leave_running(*activity);
    auto told = cause;
    const bool enabling = activity->noted && activity->command->value().kind == CommandKind::enable;
    if (activity->may_run || enabling) told.outcome = Outcome::unknown;  // its start may be under way
    activity->command->abort(std::move(told));
    drop_buffer(cause);
  }
}

void Axis::note_motion_to_stop() {
  if (activity_ && activity_->state != AxisState::standstill) stopping_.from_motion = true;
}

void Axis::begin_stop(StopKind kind, CommandPtr command) {
  stopping_.kind = std::max(stopping_.kind, kind);
  ++stopping_.requests;
  if (command) {
    command->activate();
    stopping_.last = command;
    stopping_.commands.push_back(std::move(command));
  }
  env_.bus->hasten(settings_.node, TransactionClass::moving_state);
  if (!stopping_.running) {
    stopping_.running = true;
    launch(run_stop(), "stop");
  } else {
    // The running sequence sends this one, too. It may wait for a reading that is held back, or will be,
    // because the node does not answer.
    const bool held = link_ != LinkState::online && env_.bus->holds_back(settings_.node);
    if (link_ == LinkState::offline || held) env_.bus->give_up_readings(settings_.node);
    sampled_.notify_all();
  }
}

/// What the drive may go on with after its command has ended. A command that never started leaves the ramps
/// of the motion before it in force.
void Axis::leave_running(const Activity& activity) {
  if (!activity.may_run) return;
  const auto& plan = activity.plan;
  last_deceleration_ = std::max(plan.deceleration_time, plan.granted.deceleration_time.value_or(Duration{}));
  left_running_ = left_running_ || activity.state != AxisState::standstill;
}

/// What a stop may take: the drive keeps the deceleration time that was set before the motion (7.6.2).
Duration Axis::deceleration_bound() const { return last_deceleration_; }

Task<> Axis::run_stop() {
  const auto confirmed = co_await stop_and_confirm();
  auto commands = std::exchange(stopping_.commands, {});
  stopping_.running = false;
  stopping_.kind = StopKind::none;
  stopping_.from_motion = false;
  if (confirmed) {
    observed_.standstill_confirmed(env_.clock->now());
    stop_owed_ = left_running_ = false;
    remember_position();
    for (const auto& command : commands) command->done();
  } else {
    observed_.stop_failed();
    stop_owed_ = true;
    // Whether it arrived is not known: the drive is connected anew, which begins with a stop (M4).
    if (confirmed.error().outcome == Outcome::unknown) bus_lost(confirmed.error());
    ++failed_stops_;
    if (!fault_) fault_ = confirmed.error();
    log_about_axis(spdlog::level::err, LogKind::stop_unconfirmed, settings_, to_string(confirmed.error()));
    for (const auto& command : commands) {
      if (link_ == LinkState::offline)
        command->unknown(confirmed.error());
      else
        command->error(confirmed.error());
    }
  }
  publish();
  stopped_.notify_all();
  wake();
}

void Axis::note_stop_sent(TimePoint end, bool answered) {
  const auto late = observed_.stop_sent(end, answered);
  if (!late) return;
  const auto in_ms = [](Duration time) { return std::chrono::duration<double, std::milli>(time).count(); };
  log_about_axis(
      spdlog::level::warn, LogKind::stop_late, settings_,
      fmt::format("{}: a stop frame had gone out {:.1f} ms after its request; the budget promises {:.1f} ms. "
                  "Lost frames, or this computer: relieve it, or raise host_allowance of bus {} (told once)",
                  settings_.name, in_ms(late->seen), in_ms(late->expected), settings_.bus));
}

Task<Result<void>> Axis::stop_and_confirm() {
  bool released = false;
  int silent = 0;  // replies in a row that did not come
  int rounds = 0;  // of attempts without any
  for (;;) {
    const auto requests = stopping_.requests;
    const auto kind = stopping_.kind;
    const auto sent = co_await drive_->stop(kind);
    // Open loop: a stop without a ramp may have lost steps (M12), also one of which only the reply was lost.
    const bool may_have_come = sent || sent.error().outcome == Outcome::unknown;
    if (kind == StopKind::quick_stop && may_have_come && !drive_->closed_loop()) lose_trust();
    wake();
    if (const auto out = drive_->stop_sent_at()) note_stop_sent(*out, sent.has_value());
    const bool no_reply = !sent && sent.error().reason == Reason::no_reply;
    if (no_reply && link_ != LinkState::offline && ++silent < stop_attempts) continue;
    silent = 0;
    // Replies may be lost where the stop itself is not: what counts is the motor, so go on and look at it.
    if (!sent && sent.error().reason != Reason::refused && (!no_reply || link_ == LinkState::offline)) {
      if (requests != stopping_.requests) continue;  // each gets a frame of its own, also by a silent node
      auto cause = error(Reason::not_confirmed, "the stop was not acknowledged: " + to_string(sent.error()),
                         "look at the machine; a stop is sent as soon as the drive answers");
      cause.outcome = Outcome::unknown;
      co_return fail(std::move(cause));
    }
    const auto since = env_.clock->now();
    const auto patience =
        settings_.stop_margin + (kind == StopKind::quick_stop ? Duration{0} : deceleration_bound());
    poll_fast(since, patience);
    // Only an axis that is online is polled.
    const bool polled = link_ == LinkState::online;
    const bool rests = polled ? co_await standstill_by(since, since + patience, requests)
                              : (sent || link_ != LinkState::offline) &&
                                    co_await standstill_unpolled(since + patience, requests);
    if (requests != stopping_.requests) continue;  // each gets a frame of its own
    if (rests && no_reply && ++rounds < unacknowledged_rounds) continue;
    if (rests) co_return Result<void>{};
    if (link_ == LinkState::offline) {
      auto cause = error(Reason::not_confirmed, "the drive fell silent before its standstill was confirmed",
                         "look at the machine; a stop is sent as soon as the drive answers");
      cause.outcome = Outcome::unknown;
      co_return fail(std::move(cause));
    }
    if (kind != StopKind::quick_stop) {
      log_about_axis(spdlog::level::warn, LogKind::stop_escalated, settings_,
                     fmt::format("{}: standstill not confirmed in time; quick stop", settings_.name));
      stopping_.kind = StopKind::quick_stop;
    } else if (settings_.stop_escalation_release && !released) {
      log_about_axis(spdlog::level::warn, LogKind::stop_escalated, settings_,
                     fmt::format("{}: standstill not confirmed after a quick stop; releasing the power stage",
                                 settings_.name));
      released = true;
      if (const auto off = co_await drive_->disable({}); !off) spdlog::error("{}", to_string(off.error()));
    } else {
      co_return fail(error(Reason::not_confirmed, "standstill was not confirmed",
                           "look at the machine; cut its power "
                           "if it moves; then reset the axis"));
    }
  }
}

/// Standstill counts once it was measured after `since`. Within homing the motor rests between its phases, so
/// there it must have rested at one place for a while. Not in time is only what a sample from after
/// `deadline` shows moving: on a slow line the sample may come late, and a silent node goes offline.
Task<bool> Axis::standstill_by(TimePoint since, TimePoint deadline, int requests) {
  constexpr auto rest = milliseconds(150);
  std::optional<TimePoint> resting_since;
  std::int64_t resting_at = 0;
  while (link_ != LinkState::offline && requests == stopping_.requests) {
    if (sample_ && sample_->asked_at >= since) {
      const bool settled = resting_since && !moved_from(resting_at);
      const bool rested = settled && sample_->asked_at - *resting_since >= rest;
      if (!sample_->moving && (sample_->mode != DriveMode::homing || rested)) co_return true;
      if (sample_->moving) {
        resting_since.reset();
      } else if (!settled) {
        resting_since = sample_->asked_at;
        resting_at = tracker_.counter();
      }
      if (sample_->asked_at >= deadline + (resting_since ? rest : Duration{0})) co_return false;
    }
    co_await sampled_.wait();
  }
  co_return false;
}

/// The same for a node that nobody polls, because it is not (or not yet) online. What its samples tell beside
/// the standstill is heard nowhere else (M5). `requests`: another stop than that of them ends it.
Task<bool> Axis::standstill_unpolled(TimePoint deadline, std::optional<int> requests) {
  constexpr auto pause = milliseconds(30);
  constexpr int resting_in_homing = 6;  // samples; between its phases the motor rests, too
  const auto another = [&] { return requests && *requests != stopping_.requests; };
  int resting = 0, silent = 0;
  std::int64_t resting_at = 0;
  for (;;) {
    const auto sample = co_await drive_->read_state(TransactionClass::moving_state);
    if (sample) on_sample(*sample);
    if (another() || (!sample && ++silent == stop_attempts)) co_return false;
    if (sample) {
      silent = 0;
      const bool rests = !sample->moving && (resting == 0 || !moved_from(resting_at));
      if (resting == 0) resting_at = tracker_.counter();
      resting = rests ? resting + 1 : 0;
      if (resting > 0 && sample->mode != DriveMode::homing) co_return true;
      if (resting >= resting_in_homing) co_return true;
      if (sample->asked_at >= deadline && resting == 0) co_return false;
    }
    // Samples of somebody else who looks do not shorten it.
    for (const auto until = env_.clock->now() + pause; !another() && env_.clock->now() < until;)
      co_await sampled_.wait_until(until);
    if (another()) co_return false;  // another reading might be held back
  }
}

}  // namespace axisd
