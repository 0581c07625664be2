// Reading the state again and again, and noticing that the drive is gone or was restarted.
#include "devices/axis/state_reader.hpp"

#include <algorithm>
#include <utility>

#include "devices/axis/drift_check.hpp"
#include "devices/axis/drive_connection.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

namespace {

constexpr int attempts_before_offline = 3;

}  // namespace

StateReader::StateReader(const AxisContext& context, Shaft& shaft, const LinkMachine& link,
                         const PowerMachine& power, Stopper& stopper, const Execution& execution,
                         Readings& readings, DriveConnection& connection, DriftCheck& drift,
                         Publisher& publisher)
    : context_(context),
      shaft_(shaft),
      link_(link),
      power_(power),
      stopper_(stopper),
      execution_(execution),
      readings_(readings),
      connection_(connection),
      drift_(drift),
      publisher_(publisher),
      pace_(context.settings.poll_moving, context.settings.poll_idle),
      wake_(context.env.executor, *context.env.clock) {}

StateReader::Chain::Chain(StateReader& reader) : reader_(&reader) {
  ++reader_->chains_;
  reader_->stopper_.observed().interrupted();
  reader_->wake();
}

StateReader::Chain::~Chain() {
  --reader_->chains_;
  const auto& context = reader_->context_;
  // The reading that waits since before it is of an axis at work now.
  context.env.bus->hasten(context.settings.node, TransactionClass::moving_state);
  reader_->wake();
}

Task<> StateReader::poll() {
  Polling polling;
  while (link_.online()) {
    if (chains_ > 0) {
      co_await wake_.wait();
      continue;
    }
    if (link_.bus_loss()) co_return connection_.go_offline(Error(*link_.bus_loss()));
    if (keeps_quiet()) {
      co_await wake_.wait_until(pace_.quiet_until());
      continue;
    }
    const auto began = context_.env.clock->now();
    if (!co_await poll_once(polling)) co_return;
    if (polling.woken || polling.failures > 0) continue;  // the bus's own timeouts pace the repetition
    if (execution_.works()) {
      // Whoever waits for this sample goes first: it may be the last one that is wanted.
      co_await let_others_run(context_.env.executor, *context_.env.clock);
      if (!link_.online() || link_.bus_loss() || chains_ > 0) continue;
    }
    // An axis that indexes rests for a moment only, just when its end was seen.
    drift_.look_for_drift();
    // A command that begins to wait for its turn meanwhile puts it off.
    while (next_poll(polling, began) > context_.env.clock->now())
      if (co_await wake_.wait_until(next_poll(polling, began))) break;
  }
}

/// When it is read next after a reading that was wanted at `began`.
TimePoint StateReader::next_poll(const Polling& polling, TimePoint began) const {
  // At rest it counts from the reading itself: on a full line that came long after it was wanted.
  const bool waited = !execution_.works() && context_.env.bus->start_turns() != nullptr;
  const auto asked = shaft_.sample() && (polling.repeated || waited) ? shaft_.sample()->asked_at : began;
  return std::min(pace_.next(asked, execution_.works()), continuity_.latest(execution_.works()));
}

/// What was started is not read before. Where starts need no turns a reading costs no other axis anything.
void StateReader::keep_quiet(TimePoint until) {
  if (context_.env.bus->start_turns() != nullptr) pace_.keep_quiet(until);
}

/// Whatever stops it is looked after at once.
bool StateReader::keeps_quiet() const {
  const bool begun = execution_.activity() && execution_.activity()->start.has_begun();
  return begun && !stopper_.machine().under_way() && !stopper_.machine().owed() &&
         pace_.state(context_.env.clock->now()) == PollPace::State::quiet;
}

void StateReader::poll_for_end(TimePoint from, Duration longest) {
  if (context_.env.bus->start_turns() == nullptr) return poll_fast(from, longest);
  pace_.expect_end(from, longest);
  wake();
}

void StateReader::poll_fast(TimePoint from, Duration longest) {
  pace_.expect(from, longest);
  wake();
}

Task<Result<void>> StateReader::prove_continuity(TransactionClass priority) {
  auto proof = co_await context_.drive->check_continuity(priority);
  if (proof) continuity_.proven(context_.env.clock->now());
  continuity_.fade_waits();
  co_return proof;
}

/// False: the link is gone.
Task<bool> StateReader::poll_once(Polling& polling) {
  polling.woken = polling.repeated = false;
  Result<void> result;
  const auto now = context_.env.clock->now();
  // Where an end is awaited the canary waits as long as it may.
  const bool urgent = pace_.is_fast(now) && execution_.works();
  using Pace = Continuity::Pace;
  const auto pace = urgent ? Pace::awaiting_end : execution_.works() ? Pace::moving : Pace::at_rest;
  if (continuity_.is_due(now, pace, polling.proof_due)) {
    result = co_await prove_continuity(execution_.works() ? TransactionClass::moving_state
                                                          : TransactionClass::idle_state);
    if (!result && result.error().reason == Reason::rebooted) {
      connection_.on_reboot(result.error());
      co_return false;
    }
  }
  if (result) {
    result = co_await read_next(polling);
    if (polling.woken) co_return link_.online();
    if (!result && result.error().reason == Reason::rebooted) {
      if (link_.online()) connection_.on_reboot(result.error());
      co_return false;
    }
  }
  if (!link_.online()) co_return false;  // a sequence found the reboot first
  if (result) {
    polling.failures = 0;
    co_return true;
  }
  co_return outlives(polling, result.error());
}

/// A reading, proven where that is due before it means anything. Woken in place of one: polling says so.
Task<Result<void>> StateReader::read_next(Polling& polling) {
  const auto sample = co_await next_sample(polling);
  polling.woken = sample && !*sample;
  if (polling.woken) co_return Result<void>{};
  if (!sample) co_return fail(sample.error());
  Result<void> result;
  // Its node was held back: what was proven before that says nothing of it.
  if (continuity_.forgotten((*sample)->asked_at))
    result = co_await prove_continuity(TransactionClass::moving_state);
  if (result && !seen_again(**sample)) readings_.on_sample(**sample);
  co_return result;
}

/// A reading or a proof has failed. False: the link is gone with it.
bool StateReader::outlives(Polling& polling, Error cause) {
  const bool unproven = continuity_.lost(context_.env.clock->now());
  // It was given up, as something has begun since, or cut by a stop: its node has not failed to answer.
  polling.woken = cause.reason == Reason::superseded;
  if (polling.woken && !unproven) return true;
  if (!polling.woken) pace_.not_answered();
  if (polling.woken) cause = not_heard();
  if (cause.reason != Reason::bus_down && ++polling.failures < attempts_before_offline && !unproven)
    return true;
  connection_.go_offline(cause);
  return false;
}

Error StateReader::not_heard() const {
  return context_.error(Reason::no_reply,
                        "the drive was not heard for too long, and is not asked at the moment",
                        "check power, wiring, address and baud rate of the node");
}

/// At rest the bus reads the state again and again, and tells what is new. Nothing: the axis was woken
/// before.
Task<Result<std::optional<DriveSample>>> StateReader::next_sample(Polling& polling) {
  if (execution_.works())
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
bool StateReader::seen_again(const DriveSample& sample) {
  if (continuity_.forgotten(sample.asked_at)) return false;  // to be proven first
  if (!link_.online() || execution_.busy() || power_.owes_release() || !shaft_.sample() ||
      !publisher_.shows_sampled())
    return false;
  auto known = *shaft_.sample();
  known.asked_at = sample.asked_at;
  known.measured_at = sample.measured_at;
  if (known != sample) return false;
  shaft_.take(sample);
  stopper_.observed().on_sample(sample, false);
  publisher_.show_again(sample);
  shaft_.sampled().notify_all();
  return true;
}

/// The poll loop has nothing to do but to read the state and the canary.
bool StateReader::only_watches() const {
  return chains_ == 0 && !link_.bus_loss() && !drift_.drifted() && !drift_.drift_is_next();
}

void StateReader::wake() {
  context_.env.bus->end_repetition(context_.settings.node);
  // A reading that came due since the stop began is waited for like those before.
  if (stopper_.machine().under_way())
    context_.env.bus->hasten(context_.settings.node, TransactionClass::moving_state);
  wake_.notify_all();
}

/// While its node is held back no request fails, as none is sent: nothing else would tell that nobody has
/// heard of the drive for so long.
void StateReader::watch_continuity() {
  if (!link_.online()) return;
  const auto now = context_.env.clock->now();
  if (continuity_.lost(now) && context_.env.bus->holds_back(context_.settings.node)) {
    connection_.go_offline(not_heard());
    return;
  }
  continuity_watch_ = context_.env.clock->call_at(continuity_.next_look(now), [this] { watch_continuity(); });
}

Task<Result<void>> StateReader::look(Duration oldest) {
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
      readings_.on_sample(*sample);
      co_return seen;
    }
    if (seen.error().reason != Reason::no_reply || attempt == attempts) {
      seen.error().outcome = Outcome::not_executed;  // only read
      co_return seen;
    }
  }
}

Task<Result<DriveSample>> StateReader::sample_after(TimePoint since, Duration patience) {
  const auto deadline = context_.env.clock->now() + patience;
  wake();
  while (context_.env.clock->now() < deadline && !link_.offline()) {
    if (shaft_.sample() && shaft_.sample()->asked_at >= since) co_return *shaft_.sample();
    co_await shaft_.sampled().wait_until(deadline);
  }
  co_return fail(
      context_.error(Reason::no_reply, "the drive could not be read back", "check power and wiring"));
}

}  // namespace axisd
