#include "buses/modbus_rtu/rtu_bus.hpp"

#include <algorithm>
#include <utility>

namespace axisd::modbus_rtu {

namespace {

ExchangeResult not_sent(Verdict verdict, TimePoint now) {
  return {.status = ExchangeStatus::not_sent, .verdict = verdict, .request_begin = now, .request_end = now};
}

/// Characters of a request to read; with their replies of a reading of a drive's state, and of a trigger.
constexpr std::size_t size_of_read = 8, longest_reading = 40, size_of_write = 16;
/// So old a proof may get until the next start (M6): its client takes a moment, and reboot_guard is 100 ms
/// mostly.
constexpr Duration longest_proof = std::chrono::milliseconds(80);

/// Of what may begin.
TransactionClass lowest_class(bool held) {
  return held ? TransactionClass::moving_state : TransactionClass::scan;
}

Unanswered unanswered(const Transaction& ended) {
  if (ended.transaction_class != TransactionClass::stop) return Unanswered::request;
  return ended.patient ? Unanswered::owed_stop : Unanswered::stop;
}

/// State twice, canary, block and trigger, and a reading of another axis between them, where all answer at
/// once: 169 characters and twelve silences.
Duration usual_start(const LineSettings& settings) {
  return wire_time(settings, 169) + 12 * silence(settings);
}

}  // namespace

RtuBus::RtuBus(Executor executor, Clock& clock, LineSettings settings, std::unique_ptr<Line> line)
    : executor_(std::move(executor)),
      clock_(&clock),
      settings_(std::move(settings)),
      line_(std::move(line)),
      port_changed_(executor_, clock),
      start_turns_(executor_, clock, usual_start(settings_)),
      statistics_(settings_.serial(), clock.now()) {}

RtuBus::~RtuBus() { line_.reset(); }  // it looks at what is armed

void RtuBus::start(ExchangeObserver observer) {
  observer_ = std::move(observer);
  line_->start([this](std::span<const ExchangeResult> results) { on_results(results); },
               [this](const PortStatus& status) { on_port(status); });
}

LineStatistics RtuBus::statistics() const {
  auto copy = statistics_;
  copy.waiting([this](TransactionClass transaction_class) { return waiting(transaction_class); });
  return copy;
}

StatisticsByClass RtuBus::classes() const {
  auto copy = statistics_.classes();
  for (std::size_t i = 0; i < copy.size(); ++i)
    copy.at(i).waiting = waiting(static_cast<TransactionClass>(i));
  return copy;
}

/// Of a round, too, all but the first.
std::size_t RtuBus::waiting(TransactionClass transaction_class) const {
  const auto in_round = round_.size() > 1 && transaction_class == TransactionClass::idle_state;
  return queue_.size(transaction_class) + (in_round ? round_.size() - 1 : 0);
}

std::size_t RtuBus::held_back() const {
  auto held = queue_.size();
  for (int i = 0; i < transaction_class_count; ++i) held -= queue_.size(static_cast<TransactionClass>(i));
  return held;
}

Exchange RtuBus::exchange_for(Request request, const Frame& frame, TransactionOptions options) const {
  const auto usual = turnaround_max(request.node);
  const auto turnaround = options.turnaround_max.value_or(usual);
  const auto reply = wire_time(options.serial.value_or(settings_.serial()), reply_size(request));
  const bool overrides = options.serial && options.serial != settings_.serial();
  if (overrides) options.guard = {.gate = override_gate_, .epoch = override_gate_->epoch()};
  return {.request = std::move(request),
          .guard = std::move(options.guard),
          .deadline = options.deadline,
          .reply_timeout = turnaround + reply + reply_margin,
          .turnaround_max = std::min(turnaround, usual),
          .serial = overrides ? options.serial : std::nullopt,
          .stop = options.transaction_class == TransactionClass::stop,
          .frame = frame};
}

Result<TransactionPtr> RtuBus::prepare(Request request, TransactionOptions options) const {
  auto frame = encode(request);
  if (!frame) return fail(frame.error());
  if (!port_.open) {
    auto error =
        port_.error.value_or(Error{.reason = Reason::bus_down, .message = "the port is not open yet"});
    error.where.bus = settings_.name;
    return fail(std::move(error));
  }
  if (options.serial && options.transaction_class <= TransactionClass::motion)
    return fail(Reason::internal, "stops and motion go out with the line's own serial settings only");
  auto transaction = std::make_unique<Transaction>();
  transaction->transaction_class = options.transaction_class;
  transaction->patient = options.patient;
  transaction->awaited_from = options.awaited_from;
  transaction->of_others = options.of_others;
  transaction->queued_at = clock_->now();
  transaction->exchange = exchange_for(std::move(request), *frame, std::move(options));
  return transaction;
}

void RtuBus::submit(TransactionPtr transaction) {
  const auto transaction_class = transaction->transaction_class;
  transaction->doubtful = quarantine_.doubtful(transaction->exchange.request.node);
  if (must_wait(*transaction, clock_->now()))
    queue_.hold(std::move(transaction));
  else if (transaction->watch != nullptr && transaction->watch->proves())
    queue_.push_again(std::move(transaction));  // a reading of its own follows, which waits its turn again
  else
    queue_.push(std::move(transaction));
  statistics_.queued(transaction_class, waiting(transaction_class));
}

Task<Result<Answer>> RtuBus::transact(Request request, TransactionOptions options) {
  auto transaction = prepare(std::move(request), std::move(options));
  if (!transaction) co_return fail(transaction.error());
  Promise<Result<Answer>> promise(executor_, *clock_);
  (*transaction)
      ->on_end.emplace_back([this, &promise](const Transaction& ended, const ExchangeResult& result) {
        promise.set(answer(ended, result));
      });
  // It would wait in vain, and for long where its node is held back.
  if (const auto now = clock_->now(); may_send((*transaction)->exchange.guard, now) != Verdict::send) {
    drop(*std::move(transaction), now);
  } else {
    submit(*std::move(transaction));
    pump();
  }
  co_return co_await promise.get();
}

void RtuBus::purge_superseded(std::uint8_t /*node*/, const AxisGate& gate) {
  const auto now = clock_->now();
  for (auto& transaction : queue_.take_forbidden(gate, now)) drop(std::move(transaction), now);
  pump();
}

void RtuBus::give_up_readings(std::uint8_t node) {
  const auto now = clock_->now();
  if (!recall(node))
    for (const auto& one : round_)
      one->given_up = one->given_up || (one->exchange.request.node == node && !one->of_others);
  for (auto& reading : queue_.take_reads(node, TransactionClass::idle_state))
    end(std::move(reading), not_sent(Verdict::superseded, now));
  if (auto* const watch = watch_of(node)) watch->end();
  pump();
}

void RtuBus::about_to_energise() {
  override_gate_->raise();
  purge_superseded({}, *override_gate_);
}

/// Ends what may not be sent any more.
void RtuBus::drop(TransactionPtr transaction, TimePoint now) {
  const auto verdict = may_send(transaction->exchange.guard, now);
  end(std::move(transaction), not_sent(verdict == Verdict::send ? Verdict::expired : verdict, now));
}

void RtuBus::set_turnaround_max(std::uint8_t node, std::optional<Duration> turnaround) {
  if (turnaround)
    turnarounds_.insert_or_assign(node, *turnaround);
  else
    turnarounds_.erase(node);
}

Duration RtuBus::turnaround_max(std::uint8_t node) const {
  const auto own = turnarounds_.find(node);
  return own == turnarounds_.end() ? settings_.turnaround_max : own->second;
}

/// What is armed but not bound yet is hastened in the queue, too: a stop may take its place. What is under
/// way may have to be followed by what it was sent for (resync_before).
void RtuBus::hasten(std::uint8_t node, TransactionClass to) {
  const auto concerned = [&](const TransactionPtr& one) {
    return one->exchange.request.node == node && !one->of_others && one->transaction_class > to;
  };
  const bool revoked = std::ranges::any_of(round_, concerned) && take_back();
  for (const auto& one : round_)
    if (concerned(one)) one->transaction_class = to;
  queue_.hasten(node, to);
  if (revoked) pump();
}

/// Brings line and queue in step: the most urgent sendable transaction belongs into the slot.
void RtuBus::pump() {
  const auto now = clock_->now();
  if (!round_.empty()) {
    const auto& first = *round_.front();
    const auto top = queue_.top_class();
    // State reads do not overtake each other in the slot: a reservation would be taken back each time.
    const bool motion_waits = top == TransactionClass::motion && !first.reserved;
    const bool overtaken = queue_.has_stop_before(first) || (motion_waits && *top < first.transaction_class);
    const bool dead = may_send(first.exchange.guard, now) != Verdict::send;
    const bool disturbed = round_.size() > 1 && !queue_.only_idle();
    if (!((overtaken || dead || disturbed) && take_back()) && top == TransactionClass::stop)
      line_->cut_wait();
  }
  reap(now);
  if (round_.empty() && port_.open) arm_next();
}

std::shared_ptr<void> RtuBus::hold() {
  auto token = held_.lock();
  if (token) return token;
  token = std::shared_ptr<void>(this, [alive = std::weak_ptr(alive_)](void* bus) {
    if (!alive.expired()) static_cast<RtuBus*>(bus)->pump();
  });
  held_ = token;
  if (!round_.empty() && round_.front()->transaction_class > lowest_class(held())) take_back();
  pump();
  return token;
}

/// Empties the slot; what was carried out of a round by then has ended. False: something is under way. No
/// more follows it.
bool RtuBus::take_back() {
  const auto results = line_->revoke();
  if (results) finish(*results);
  return results.has_value();
}

/// What was not carried out takes its place again.
void RtuBus::finish(std::span<const ExchangeResult> results) {
  const auto now = clock_->now();
  auto round = std::exchange(round_, {});
  for (std::size_t i = 0; i < round.size(); ++i) {
    round[i]->exchange.then = nullptr;
    if (i < results.size())
      finish(std::move(round[i]), results[i], now);
    else if (!port_.open)
      end(std::move(round[i]), {.status = ExchangeStatus::not_sent});
    else if (round[i]->given_up)
      end(std::move(round[i]), not_sent(Verdict::superseded, now));
    else if (may_send(round[i]->exchange.guard, now) != Verdict::send)
      drop(std::move(round[i]), now);
    else
      queue_.put_back(std::move(round[i]));
  }
}

/// What the order of the queue says; but whoever waits for the end of a motion goes before a start that can
/// wait. Not where so many starts wait that the reading would be too old to be the proof for the next start
/// of its axis (M6), nor in the turn of a group (M22). Each turn to start gives way to one of what waits with
/// the readings of moving axes, and to a few that turns before it were spared: so much the published start
/// counts. Nothing gives way while the line is held for a start at a moment.
TransactionPtr RtuBus::pop(TimePoint now) {
  if (held()) return queue_.pop(lowest_class(true));
  if (queue_.size(TransactionClass::motion) == 0 || !starts_can_wait(now)) return queue_.pop();
  if (start_turns_.starts_of_turn() > 1) return queue_.pop();
  if (start_turns_.expected_wait() + usual_start(settings_) > longest_proof) return queue_.pop();
  const auto turns = start_turns_.begun();
  gave_way_ = std::max(gave_way_, turns - std::min(turns, most_that_go_first));
  if (gave_way_ == turns) return queue_.pop();
  // By then a reading would arrive at its drive.
  const auto asked = now + silence(settings_.serial()) + wire_time(settings_.serial(), size_of_read);
  auto next = queue_.pop(asked);
  if (next->transaction_class == TransactionClass::moving_state || next->patient) ++gave_way_;
  return next;
}

/// All that waits as motion, as the last of it comes behind the reading, too.
bool RtuBus::starts_can_wait(TimePoint now) const {
  return queue_.all_of(TransactionClass::motion,
                       [this, now](const Transaction& motion) { return can_wait(motion, now); });
}

/// It is part of one axis's start, and its guard leaves time for what would go before it, and for another
/// frame of its chain behind it, one of them answered as late as may be (M6). What no gate guards is a
/// reading: that of a start, which is over soon, that of a group (M22), or that of a stop, whose bound counts
/// none before it. Members of a group start back to back.
bool RtuBus::can_wait(const Transaction& motion, TimePoint now) const {
  const auto& exchange = motion.exchange;
  if (!exchange.guard.gate || exchange.guard.with) return false;
  const auto until = std::min(exchange.deadline, exchange.guard.not_after);
  if (until == TimePoint::max()) return true;
  const auto& line = settings_.serial();
  const auto wire =
      wire_time(line, longest_reading + exchange.frame.size() + reply_size(exchange.request) + size_of_write);
  const auto leaves_time = [&](Duration turnaround) {
    return now + wire + 6 * silence(line) + std::max(turnaround_max(exchange.request.node), turnaround) <
           until;
  };
  // Whichever of the readings goes first.
  return leaves_time({}) && queue_.all_of(TransactionClass::moving_state, [&](const Transaction& reading) {
    return leaves_time(reading.exchange.turnaround_max);
  });
}

void RtuBus::arm_next() {
  const auto now = clock_->now();
  while (auto next = pop(now)) {
    if (may_send(next->exchange.guard, now) != Verdict::send) {
      drop(std::move(next), now);
    } else if (must_wait(*next, now)) {
      queue_.hold(std::move(next));
    } else {
      round_.push_back(std::move(next));
      break;
    }
  }
  await_release();
  if (round_.empty()) return;
  auto& first = round_.front();
  if (first->transaction_class != TransactionClass::stop && late_.may_answer(first->exchange.request, now))
    first = resync_before(std::move(first));
  else
    extend_round();
  line_->arm(round_.front()->exchange);
  // Of those that wait together, each has to be cut where its node is silent.
  if (queue_.top_class() == TransactionClass::stop) line_->cut_wait();
}

/// The quarantine of its node forbids sending it now, or no answer to it could be told from a late one.
bool RtuBus::must_wait(const Transaction& transaction, TimePoint now) const {
  using enum TransactionClass;
  const bool urgent = transaction.transaction_class == stop && !transaction.patient;
  if (urgent || transaction.transaction_class == scan || transaction.exchange.serial) return false;
  const auto& request = transaction.exchange.request;
  return quarantine_.ready_at(request.node) > now ||
         (transaction.transaction_class != stop && late_.may_answer(request, now) &&
          !late_.distinct_read(request, now));
}

bool RtuBus::holds_back(std::uint8_t node) const {
  const auto now = clock_->now();
  return ready_at(node, now) > now;
}

/// When what waits for this node may be looked at again.
TimePoint RtuBus::ready_at(std::uint8_t node, TimePoint now) const {
  const auto probed = quarantine_.ready_at(node);
  return probed > now ? probed : late_.distinct_at(node, now);
}

/// What was put aside is looked at again as soon as the first of it may be sent.
void RtuBus::await_release() {
  auto next = TimePoint::max();
  const auto now = clock_->now();
  for (const auto node : queue_.held_nodes()) next = std::min(next, ready_at(node, now));
  release_ = next == TimePoint::max() ? Clock::Timer{} : clock_->call_at(next, [this] {
    release_ready();
    pump();
  });
}

/// What is still held must not take a place: the queue's reservation would be spent on it.
void RtuBus::release_ready() {
  const auto now = clock_->now();
  for (const auto node : queue_.held_nodes())
    if (ready_at(node, now) <= now) queue_.release(node, now);
}

void RtuBus::note_silence(const Transaction& ended, const ExchangeResult& result) {
  const auto node = ended.exchange.request.node;
  switch (result.status) {
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
      if (ended.transaction_class == TransactionClass::scan || ended.exchange.serial) break;
      quarantine_.silent(node, clock_->now(),
                         result.reply_end - result.request_begin + silence(settings_.serial()),
                         unanswered(ended));
      break;
    case ExchangeStatus::replied:
    case ExchangeStatus::corrupt:  // somebody is there
      quarantine_.answered(node);
      queue_.release(node, clock_->now());
      break;
    default:
      break;
  }
}

/// A read whose reply cannot be a late one goes first: older ones are then discarded as foreign. Decided here
/// and not when the read is queued: what it waits for may time out meanwhile.
TransactionPtr RtuBus::resync_before(TransactionPtr waiting) {
  auto distinct = late_.distinct_read(waiting->exchange.request, clock_->now());
  if (!distinct) return waiting;  // of a bus scan, which does not wait
  auto resync = std::make_unique<Transaction>();
  resync->transaction_class = waiting->transaction_class;
  resync->sequence = waiting->sequence;
  resync->reserved = waiting->reserved;
  resync->of_others = waiting->of_others;
  resync->queued_at = waiting->queued_at;
  resync->released_at = waiting->released_at;
  resync->resync = true;
  resync->exchange = waiting->exchange;
  resync->exchange.then = nullptr;
  resync->exchange.known = nullptr;
  auto& request = resync->exchange.request = *std::move(distinct);
  const auto frame = encode(request);
  if (!frame) return waiting;  // cannot be: it is of the lengths that there are
  resync->exchange.frame = *frame;
  resync->exchange.reply_timeout +=
      wire_time(resync->exchange.serial.value_or(settings_.serial()), reply_size(request)) -
      wire_time(resync->exchange.serial.value_or(settings_.serial()), reply_size(waiting->exchange.request));
  auto held = std::make_shared<TransactionPtr>(std::move(waiting));
  resync->on_end.emplace_back([this, held](const Transaction& ended, const ExchangeResult& result) {
    (*held)->transaction_class = std::min((*held)->transaction_class, ended.transaction_class);
    if (result.status == ExchangeStatus::replied && port_.open) return queue_.put_back(std::move(*held));
    if (!port_.open) return end(std::move(*held), {.status = ExchangeStatus::not_sent});
    for (const auto& tell : (*held)->on_end) tell(**held, result);
  });
  return resync;
}

void RtuBus::reap(TimePoint now) {
  for (auto& transaction : queue_.take_expired(now)) drop(std::move(transaction), now);
  const auto next = queue_.next_expiry();
  expiry_ = next == TimePoint::max()
                ? Clock::Timer{}
                : clock_->call_at(next + std::chrono::nanoseconds(1), [this] { pump(); });
}

void RtuBus::on_results(std::span<const ExchangeResult> results) {
  finish(results);
  pump();
}

void RtuBus::finish(TransactionPtr transaction, const ExchangeResult& result, TimePoint now) {
  late_.note(transaction->exchange.request, result, now);
  note_garbled(transaction->exchange.request, result);
  note_silence(*transaction, result);
  note_known(transaction->exchange, result);
  if (is_repeated(*transaction, result))
    repeat(std::move(transaction), result, now);
  else
    end(std::move(transaction), result);
}

void RtuBus::close() {
  closed_ = true;
  on_port({.open = false, .error = Error{.reason = Reason::cancelled, .message = "the bus is being closed"}});
  if (!round_.empty()) take_back();
}

void RtuBus::on_port(const PortStatus& status) {
  if (closed_ && status.open) return;
  port_ = status;
  if (port_.error) port_.error->where.bus = settings_.name;
  // What may come late may still come: late_ stays.
  quarantine_.forget();
  if (!port_.open) {
    line_disturbed_ = clock_->now();
    // What is under way gets its own result from the line; what waits can no longer be sent in time.
    const ExchangeResult lost{.status = ExchangeStatus::not_sent, .verdict = Verdict::send};
    for (auto& transaction : queue_.take_all()) end(std::move(transaction), lost);
    for (const auto& [node, watch] : watches_)
      if (auto transaction = watch ? watch->take_resting() : nullptr) end(std::move(transaction), lost);
  }
  port_changed_.notify_all();
  pump();
}

std::optional<TimePoint> RtuBus::stop_sent_at(std::uint8_t node) const {
  const auto* found = stops_sent_.find(node);
  return found == nullptr ? std::nullopt : std::optional(*found);
}

void RtuBus::note(const Transaction& transaction, const ExchangeResult& result) {
  using enum ExchangeStatus;
  const bool sent = result.status != not_sent && result.status != unsupported && result.status != io_error;
  if (sent && transaction.transaction_class == TransactionClass::stop && result.request_end != TimePoint{})
    stops_sent_[transaction.exchange.request.node] = result.request_end;
  note_disturbance(transaction.exchange.request, result);
  statistics_.ended(transaction, result);
  if (observer_) observer_(transaction, result);
}

void RtuBus::end(TransactionPtr transaction, const ExchangeResult& result) {
  note(*transaction, result);
  for (const auto& tell : transaction->on_end) tell(*transaction, result);
}

std::optional<QuarantinedNode> RtuBus::quarantined(std::uint8_t node) const {
  const auto* found = quarantine_.nodes().find(node);
  if (found == nullptr || !found->quarantined()) return std::nullopt;
  return QuarantinedNode{.since = found->since, .next = found->next, .probes = found->probes};
}

}  // namespace axisd::modbus_rtu
