// Reading the state again and again, and noticing that the drive is gone or was restarted.
#include <algorithm>
#include <utility>

#include "devices/axis/axis.hpp"

namespace axisd {

namespace {

constexpr int attempts_before_offline = 3;

}  // namespace

Task<> Axis::poll() {
  Polling polling;
  while (link_.online()) {
    if (chains_ > 0) {
      co_await wake_.wait();
      continue;
    }
    if (link_.bus_loss()) co_return go_offline(Error(*link_.bus_loss()));
    if (keeps_quiet()) {
      co_await wake_.wait_until(pace_.quiet_until());
      continue;
    }
    const auto began = context_.env.clock->now();
    if (!co_await poll_once(polling)) co_return;
    if (polling.woken || polling.failures > 0) continue;  // the bus's own timeouts pace the repetition
    if (works()) {
      // Whoever waits for this sample goes first: it may be the last one that is wanted.
      co_await let_others_run(context_.env.executor, *context_.env.clock);
      if (!link_.online() || link_.bus_loss() || chains_ > 0) continue;
    }
    // An axis that indexes rests for a moment only, just when its end was seen.
    look_for_drift();
    // A command that begins to wait for its turn meanwhile puts it off.
    while (next_poll(polling, began) > context_.env.clock->now())
      if (co_await wake_.wait_until(next_poll(polling, began))) break;
  }
}

/// When it is read next after a reading that was wanted at `began`.
TimePoint Axis::next_poll(const Polling& polling, TimePoint began) const {
  // At rest it counts from the reading itself: on a full line that came long after it was wanted.
  const bool waited = !works() && context_.env.bus->start_turns() != nullptr;
  const auto asked = shaft_.sample() && (polling.repeated || waited) ? shaft_.sample()->asked_at : began;
  return std::min(pace_.next(asked, works()), continuity_.latest(works()));
}

/// What was started is not read before. Where starts need no turns a reading costs no other axis anything.
void Axis::keep_quiet(TimePoint until) {
  if (context_.env.bus->start_turns() != nullptr) pace_.keep_quiet(until);
}

/// Whatever stops it is looked after at once.
bool Axis::keeps_quiet() const {
  const bool begun = activity_ && activity_->start.has_begun();
  return begun && !stop_.under_way() && !stop_.owed() &&
         pace_.state(context_.env.clock->now()) == PollPace::State::quiet;
}

void Axis::poll_for_end(TimePoint from, Duration longest) {
  if (context_.env.bus->start_turns() == nullptr) return poll_fast(from, longest);
  pace_.expect_end(from, longest);
  wake();
}

void Axis::poll_fast(TimePoint from, Duration longest) {
  pace_.expect(from, longest);
  wake();
}

/// The drive was not restarted since its parameters were last written.
Task<Result<void>> Axis::prove_continuity(TransactionClass priority) {
  auto proof = co_await context_.drive->check_continuity(priority);
  if (proof) continuity_.proven(context_.env.clock->now());
  continuity_.fade_waits();
  co_return proof;
}

/// False: the link is gone.
Task<bool> Axis::poll_once(Polling& polling) {
  polling.woken = polling.repeated = false;
  Result<void> result;
  const auto now = context_.env.clock->now();
  // Where an end is awaited the canary waits as long as it may.
  const bool urgent = pace_.is_fast(now) && works();
  using Pace = Continuity::Pace;
  const auto pace = urgent ? Pace::awaiting_end : works() ? Pace::moving : Pace::at_rest;
  if (continuity_.is_due(now, pace, polling.proof_due)) {
    result =
        co_await prove_continuity(works() ? TransactionClass::moving_state : TransactionClass::idle_state);
    if (!result && result.error().reason == Reason::rebooted) {
      on_reboot(result.error());
      co_return false;
    }
  }
  if (result) {
    const auto sample = co_await next_sample(polling);
    polling.woken = sample && !*sample;
    if (polling.woken) co_return link_.online();
    if (!sample) result = fail(sample.error());
    // Its node was held back: what was proven before that says nothing of it.
    else if (continuity_.forgotten((*sample)->asked_at))
      result = co_await prove_continuity(TransactionClass::moving_state);
    if (result && !seen_again(**sample)) on_sample(**sample);
    if (!result && result.error().reason == Reason::rebooted) {
      if (link_.online()) on_reboot(result.error());
      co_return false;
    }
  }
  if (!link_.online()) co_return false;  // a sequence found the reboot first
  if (result) {
    polling.failures = 0;
    co_return true;
  }
  const bool unproven = continuity_.lost(context_.env.clock->now());
  // It was given up, as something has begun since, or cut by a stop: its node has not failed to answer.
  polling.woken = result.error().reason == Reason::superseded;
  if (polling.woken && !unproven) co_return true;
  if (!polling.woken) pace_.not_answered();
  if (polling.woken) result = fail(not_heard());
  if (result.error().reason == Reason::bus_down || ++polling.failures >= attempts_before_offline ||
      unproven) {
    go_offline(result.error());
    co_return false;
  }
  co_return true;
}

Error Axis::not_heard() const {
  return context_.error(Reason::no_reply,
                        "the drive was not heard for too long, and is not asked at the moment",
                        "check power, wiring, address and baud rate of the node");
}

/// At rest the bus reads the state again and again, and tells what is new. Nothing: the axis was woken
/// before.
Task<Result<std::optional<DriveSample>>> Axis::next_sample(Polling& polling) {
  if (works())
    co_return co_await context_.drive->read_state(TransactionClass::moving_state, pace_.awaited_from());
  if (polling.failures > 0) co_return co_await context_.drive->read_state(TransactionClass::idle_state);
  StateWatch watch{.period = context_.settings.poll_idle};
  watch.goes_on = [this, &polling](const DriveSample& sample) {
    const bool goes_on = seen_again(sample) && only_watches();
    polling.repeated = polling.repeated || goes_on;
    return goes_on;
  };
  watch.proof_due = [this, &polling](TimePoint next, Duration waited) {
    continuity_.waited(waited);
    return polling.proof_due = continuity_.due_beside(next, context_.settings.poll_idle);
  };
  watch.proven = [this](TimePoint at) { continuity_.proven(at); };
  co_return co_await context_.drive->watch_state(std::move(watch));
}

/// The drive is as it was, and nothing has changed about the axis since it was looked at with that state:
/// then only the time at which that is known has.
bool Axis::seen_again(const DriveSample& sample) {
  if (continuity_.forgotten(sample.asked_at)) return false;  // to be proven first
  if (!link_.online() || revision_ != sampled_revision_ || busy() || power_.owes_release() ||
      !shaft_.sample() || note_eeprom_writes() || shown_->link_note != context_.drive->link_note() ||
      shown_->start_note != context_.drive->no_common_start())
    return false;
  auto known = *shaft_.sample();
  known.asked_at = sample.asked_at;
  known.measured_at = sample.measured_at;
  if (known != sample) return false;
  shaft_.take(sample);
  observed_.on_sample(sample, false);
  shown_->sampled.set(sample.asked_at, sample.measured_at, context_.env.clock->wall(sample.measured_at));
  shaft_.sampled().notify_all();
  return true;
}

/// The poll loop has nothing to do but to read the state and the canary.
bool Axis::only_watches() const {
  return chains_ == 0 && !link_.bus_loss() && !drift_.drifted() && !drift_is_next();
}

/// The poll loop has something to look at.
void Axis::wake() {
  context_.env.bus->end_repetition(context_.settings.node);
  // A reading that came due since the stop began is waited for like those before.
  if (stop_.under_way()) context_.env.bus->hasten(context_.settings.node, TransactionClass::moving_state);
  wake_.notify_all();
}

/// While its node is held back no request fails, as none is sent: nothing else would tell that nobody has
/// heard of the drive for so long.
void Axis::watch_continuity() {
  if (!link_.online()) return;
  const auto now = context_.env.clock->now();
  if (continuity_.lost(now) && context_.env.bus->holds_back(context_.settings.node)) {
    go_offline(not_heard());
    return;
  }
  continuity_watch_ = context_.env.clock->call_at(continuity_.next_look(now), [this] { watch_continuity(); });
}

}  // namespace axisd
