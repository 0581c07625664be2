// Stopping: one sequence per axis sends, confirms and escalates (M12 to M14).
#include "devices/axis/stopper.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "devices/axis/axis_log.hpp"
#include "devices/axis/drive_connection.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/saved_position.hpp"
#include "devices/axis/sequences.hpp"
#include "devices/axis/state_reader.hpp"

namespace axisd {

namespace {

StopMachine::Answer answer_of(const Result<void>& sent) {
  using Answer = StopMachine::Answer;
  if (sent) return Answer::acknowledged;
  if (sent.error().reason == Reason::refused) return Answer::refused;
  return sent.error().reason == Reason::no_reply ? Answer::no_reply : Answer::failed;
}

/// The first attempt to open a port takes some 10 ms. One that hangs is not waited for any longer.
constexpr auto longest_first_opening = std::chrono::seconds(2);

/// Right after the start of the daemon nobody knows yet whether there is a port.
bool is_being_opened(const PortStatus& port) { return !port.open && !port.error; }

Task<> first_attempt_to_open(Bus& bus, const Clock& clock) {
  const auto until = clock.now() + longest_first_opening;
  while (is_being_opened(bus.port()) && clock.now() < until) co_await bus.port_changed().wait_until(until);
}

}  // namespace

Stopper::Stopper(const AxisContext& context, Sequences& sequences, Shaft& shaft, DriveConnection& connection,
                 const LinkMachine& link, StateReader& reader, Readings& readings, Execution& execution,
                 SavedPosition& saved, Publisher& publisher)
    : context_(context),
      sequences_(sequences),
      shaft_(shaft),
      connection_(connection),
      link_(link),
      reader_(reader),
      readings_(readings),
      execution_(execution),
      saved_(saved),
      publisher_(publisher),
      stop_(*context.gate, context.env.holds),
      stopped_(context.env.executor, *context.env.clock),
      observed_(context.env.stop_delays) {
  stop_.set_deceleration(
      context_.planner.braking_time(context_.settings.limits.velocity, stop_.deceleration()));
}

void Stopper::begin_stop(StopKind kind, CommandPtr command) {
  stop_.ask(kind);
  if (command) {
    command->activate();
    if (const auto oldest = stop_.serve(std::move(command)))
      oldest->abort(context_.error(Reason::superseded, "newer stops of the same client have taken its place",
                                   "wait for the newest one"));
  }
  context_.env.bus->hasten(context_.settings.node, TransactionClass::moving_state);
  if (stop_.begin()) {
    sequences_.launch(run_stop(), "stop");
  } else {
    // The running sequence sends this one, too. It may wait for a reading that is held back, or will be,
    // because the node does not answer.
    const bool held = !link_.online() && context_.env.bus->holds_back(context_.settings.node);
    if (link_.offline() || held) context_.env.bus->give_up_readings(context_.settings.node);
    shaft_.sampled().notify_all();
  }
}

/// How long the drive brakes in such a stop, at most: by the motion in progress, or in a quick stop on a ramp
/// of the drive's own from limits.velocity.
Duration Stopper::braking_time(StopKind kind) const {
  if (kind != StopKind::quick_stop) return stop_.deceleration();
  const auto rpm = std::ceil(std::abs(context_.scale.velocity_to_rpm(context_.settings.limits.velocity)));
  return context_.drive->quick_stop_time(static_cast<int>(rpm)).value_or(stop_.deceleration());
}

Task<> Stopper::run_stop() {
  if (is_being_opened(context_.env.bus->port())) {
    co_await first_attempt_to_open(*context_.env.bus, *context_.env.clock);
    observed_.stop_failed();  // its time is not one of those that the budget promises: there was no port
  }
  const auto confirmed = co_await stop_and_confirm();
  const auto commands = confirmed ? stop_.confirmed() : stop_.failed();
  if (confirmed) {
    observed_.standstill_confirmed(context_.env.clock->now());
    saved_.remember_position();
    for (const auto& command : commands) command->done();
  } else {
    observed_.stop_failed();
    // Whether it arrived is not known: the drive is connected anew, which begins with a stop (M4).
    if (confirmed.error().outcome == Outcome::unknown) connection_.bus_lost(confirmed.error());
    // Nothing that this daemon began can go on in a drive that it has never heard: it gets the stop that is
    // owed when it is connected, and comes online once it rests (M4).
    const bool never_heard = !connection_.identity() && confirmed.error().outcome == Outcome::unknown;
    if (!never_heard) execution_.note_fault(confirmed.error());
    log_about_axis(spdlog::level::err, LogKind::stop_unconfirmed, context_.settings,
                   to_string(confirmed.error()));
    for (const auto& command : commands) {
      if (link_.offline())
        command->unknown(confirmed.error());
      else
        command->error(confirmed.error());
    }
  }
  publisher_.publish();
  stopped_.notify_all();
  reader_.wake();
}

void Stopper::note_stop_sent(TimePoint end, bool answered) {
  const auto late = observed_.stop_sent(end, answered);
  if (!late) return;
  const auto in_ms = [](Duration time) { return std::chrono::duration<double, std::milli>(time).count(); };
  log_about_axis(
      spdlog::level::warn, LogKind::stop_late, context_.settings,
      fmt::format("{}: a stop frame had gone out {:.1f} ms after its request; the budget promises {:.1f} ms. "
                  "Lost frames, or this computer: relieve it, or raise host_allowance of bus {} (told once)",
                  context_.settings.name, in_ms(late->seen), in_ms(late->expected), context_.settings.bus));
}

Error Stopper::not_stopped(StopMachine::Step step, const Result<void>& sent) const {
  auto cause = context_.error(Reason::not_confirmed, "standstill was not confirmed",
                              "look at the machine; cut its power if it moves; then reset the axis");
  if (step == StopMachine::Step::not_confirmed) return cause;
  cause = context_.error(Reason::not_confirmed,
                         step == StopMachine::Step::unreachable && !sent
                             ? "the stop was not acknowledged: " + to_string(sent.error())
                             : "the drive fell silent before its standstill was confirmed",
                         "look at the machine; a stop is sent as soon as the drive answers");
  cause.outcome = Outcome::unknown;
  return cause;
}

Task<Result<void>> Stopper::stop_and_confirm() {
  using Step = StopMachine::Step;
  StopKind last = StopKind::none;
  std::optional<TimePoint> unanswered;  // since when stops of that kind are sent without a reply
  for (;;) {
    const auto kind = stop_.next_attempt();
    if (std::exchange(last, kind) != kind) unanswered.reset();
    const auto sent = co_await context_.drive->stop(kind);
    // Open loop: a stop without a ramp may have lost steps (M12), also one of which only the reply was lost.
    const bool may_have_come = sent || sent.error().outcome == Outcome::unknown;
    if (kind == StopKind::quick_stop && may_have_come && !context_.drive->closed_loop())
      readings_.lose_trust();
    reader_.wake();
    if (const auto out = context_.drive->stop_sent_at()) note_stop_sent(*out, sent.has_value());
    auto step = stop_.sent(answer_of(sent), link_.offline());
    if (step == Step::look) {
      const auto now = context_.env.clock->now();
      if (sent) unanswered.reset();
      if (!sent && !unanswered) unanswered = now;
      const auto found = co_await rests_in_time(sent.has_value(), unanswered.value_or(now));
      step = stop_.looked(found, link_.offline(), context_.settings.stop_escalation_release);
    }
    switch (step) {
      case Step::send:
      case Step::look:
        break;
      case Step::quicken:
        log_about_axis(
            spdlog::level::warn, LogKind::stop_escalated, context_.settings,
            fmt::format("{}: standstill not confirmed in time; quick stop", context_.settings.name));
        break;
      case Step::release:
        log_about_axis(
            spdlog::level::warn, LogKind::stop_escalated, context_.settings,
            fmt::format("{}: standstill not confirmed after a quick stop; releasing the power stage",
                        context_.settings.name));
        if (const auto off = co_await context_.drive->disable({}); !off)
          spdlog::error("{}", to_string(off.error()));
        break;
      case Step::rests:
        co_return Result<void>{};
      case Step::unreachable:
      case Step::fell_silent:
      case Step::not_confirmed:
        co_return fail(not_stopped(step, sent));
    }
  }
}

/// After a stop frame, which was acknowledged or not. `since`: the first of those that were not. Undecided:
/// it moves, and none of them may have arrived.
Task<RestVerdict> Stopper::rests_in_time(bool acknowledged, TimePoint since) {
  const auto now = context_.env.clock->now();
  const auto deadline =
      since + stop_.patience(context_.settings.stop_margin, braking_time(StopKind::quick_stop));
  reader_.poll_fast(now, std::max<Duration>(deadline - now, start_window));
  // Only an axis that is online is polled: not one whose drive was restarted meanwhile.
  if (link_.online()) {
    const auto found = co_await standstill_by(acknowledged, deadline);
    const bool polled = found == RestVerdict::rests || link_.shown() != LinkState::configuring;
    if (polled || stop_.overtaken()) co_return found;
  } else if (!acknowledged && link_.offline()) {
    co_return RestVerdict::moves;
  }
  co_return co_await standstill_unpolled(deadline, true) ? RestVerdict::rests : RestVerdict::moves;
}

Task<RestVerdict> Stopper::standstill_by(bool acknowledged, TimePoint deadline) {
  const auto since = context_.env.clock->now();
  StandstillWatch watch(since, deadline);
  while (link_.online() && !stop_.overtaken()) {
    if (shaft_.sample() && !stop_.unseen_start().may_begin()) {
      const auto found =
          watch.look(*shaft_.sample(), shaft_.tracker().counter(), context_.drive->position_window());
      if (found != RestVerdict::undecided) co_return found;
      if (!acknowledged && shaft_.sample()->moving && shaft_.sample()->asked_at >= since)
        co_return RestVerdict::undecided;
    }
    co_await shaft_.sampled().wait();
  }
  co_return RestVerdict::moves;
}

/// The same for a node that nobody polls, because it is not (or not yet) online. What its samples tell beside
/// the standstill is heard nowhere else (M5). `of_stop`: another stop than the one under way ends it.
Task<bool> Stopper::standstill_unpolled(TimePoint deadline, bool of_stop) {
  constexpr auto pause = milliseconds(30);
  const auto another = [&] { return of_stop && stop_.overtaken(); };
  UnpolledStandstill watch(deadline);
  for (;;) {
    const auto begun = stop_.unseen_start().begun();
    const auto sample = co_await context_.drive->read_state(TransactionClass::moving_state);
    if (sample) readings_.on_sample(*sample);
    if (another() || stop_.unseen_start().begun() != begun) co_return false;
    auto found = RestVerdict::undecided;
    if (!sample)
      found = watch.silence();
    else if (!stop_.unseen_start().may_begin())
      found = watch.look(*sample, shaft_.tracker().counter(), context_.drive->position_window());
    if (found != RestVerdict::undecided) co_return found == RestVerdict::rests;
    // Samples of somebody else who looks do not shorten it.
    for (const auto until = context_.env.clock->now() + pause;
         !another() && context_.env.clock->now() < until;)
      co_await shaft_.sampled().wait_until(until);
    if (another()) co_return false;  // another reading might be held back
  }
}

}  // namespace axisd
