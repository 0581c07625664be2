#include "buses/modbus_rtu/rtu_bus.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace axisd::modbus_rtu {

namespace {

/// So long after its time a reply may still come: gateways and drives that save to their EEPROM.
constexpr auto latest_reply = std::chrono::seconds(5);
/// Damaged replies in a row that are no accident any more.
constexpr int garbled_often = 3;

ExchangeResult not_sent(Verdict verdict, TimePoint now) {
  return {.status = ExchangeStatus::not_sent, .verdict = verdict, .request_begin = now, .request_end = now};
}

Error not_sent_error(Verdict verdict) {
  switch (verdict) {
    case Verdict::expired:
      return {.reason = Reason::expired,
              .message = "not sent: its time had passed",
              .remedy = "repeat the request"};
    case Verdict::lease_lost:
      return {.reason = Reason::lease_lost,
              .message = "not sent: the lease is gone",
              .remedy = "acquire it again"};
    default:
      return {.reason = Reason::superseded, .message = "not sent: a stop or a newer command took its place"};
  }
}

Error garbled_error(int in_a_row) {
  Error error{.reason = Reason::no_reply,
              .message = "only damaged bytes came back",
              .remedy = "check termination, shielding and that no address is used twice",
              .outcome = Outcome::unknown};
  if (in_a_row >= garbled_often) {
    error.message =
        fmt::format("only damaged bytes came back, {} times in a row (two nodes on one address?)", in_a_row);
    error.remedy =
        "switch off one node after the other to find a second one with this address; else check the "
        "baud rate, termination and shielding";
  }
  return error;
}

}  // namespace

RtuBus::RtuBus(Executor executor, Clock& clock, LineSettings settings, std::unique_ptr<Line> line)
    : executor_(std::move(executor)),
      clock_(&clock),
      settings_(std::move(settings)),
      line_(std::move(line)),
      port_changed_(executor_, clock),
      statistics_(settings_.serial(), clock.now()) {}

RtuBus::~RtuBus() = default;

void RtuBus::start(ExchangeObserver observer) {
  observer_ = std::move(observer);
  line_->start([this](const ExchangeResult& result) { on_result(result); },
               [this](const PortStatus& status) { on_port(status); });
}

bool RtuBus::may_come_late(std::uint8_t node, std::uint16_t count) const {
  const auto late = late_reads_.find(node);
  if (late == late_reads_.end()) return false;
  const auto read = late->second.find(count);
  return read != late->second.end() && read->second >= clock_->now();
}

bool RtuBus::needs_resync(const Request& request) const {
  return request.function == Function::read_holding_registers && may_come_late(request.node, request.count);
}

int RtuBus::garbled(std::uint8_t node) const {
  const auto found = garbled_.find(node);
  return found == garbled_.end() ? 0 : found->second;
}

LineStatistics RtuBus::statistics() const {
  auto copy = statistics_;
  copy.waiting([this](TransactionClass transaction_class) { return queue_.size(transaction_class); });
  return copy;
}

std::size_t RtuBus::held_back() const {
  auto held = queue_.size();
  for (int i = 0; i < transaction_class_count; ++i) held -= queue_.size(static_cast<TransactionClass>(i));
  return held;
}

Exchange RtuBus::exchange_for(Request request, const Frame& frame, TransactionOptions options) const {
  const auto turnaround = options.turnaround_max.value_or(settings_.turnaround_max);
  const auto reply = wire_time(options.serial.value_or(settings_.serial()), reply_size(request));
  const bool overrides = options.serial && options.serial != settings_.serial();
  if (overrides) options.guard = {.gate = override_gate_, .epoch = override_gate_->epoch()};
  return {.request = std::move(request),
          .frame = frame,
          .guard = std::move(options.guard),
          .deadline = options.deadline,
          .reply_timeout = turnaround + reply + reply_margin,
          .turnaround_max = std::min(turnaround, settings_.turnaround_max),
          .serial = overrides ? options.serial : std::nullopt};
}

Task<Result<Answer>> RtuBus::transact(Request request, TransactionOptions options) {
  auto frame = encode(request);
  if (!frame) co_return fail(frame.error());
  if (!port_.open) {
    auto error =
        port_.error.value_or(Error{.reason = Reason::bus_down, .message = "the port is not open yet"});
    error.where.bus = settings_.name;
    co_return fail(std::move(error));
  }
  if (options.serial && options.transaction_class <= TransactionClass::motion)
    co_return fail(Reason::internal, "stops and motion go out with the line's own serial settings only");
  auto transaction = std::make_unique<Transaction>();
  transaction->transaction_class = options.transaction_class;
  const auto transaction_class = options.transaction_class;
  transaction->queued_at = clock_->now();
  transaction->exchange = exchange_for(std::move(request), *frame, std::move(options));

  Promise<Result<Answer>> promise(executor_, *clock_);
  transaction->on_end.emplace_back([this, &promise](const Transaction& ended, const ExchangeResult& result) {
    promise.set(answer(ended, result));
  });
  if (held_until(*transaction))
    queue_.hold(std::move(transaction));
  else
    queue_.push(std::move(transaction));
  statistics_.queued(transaction_class, queue_.size(transaction_class));
  pump();
  co_return co_await promise.get();
}

void RtuBus::purge_superseded() { pump(); }

void RtuBus::about_to_energise() {
  override_gate_->raise();
  pump();
}

void RtuBus::hasten(std::uint8_t node, TransactionClass to) { queue_.hasten(node, to); }

/// Brings line and queue in step: the most urgent sendable transaction belongs into the slot.
void RtuBus::pump() {
  const auto now = clock_->now();
  if (current_) {
    const auto top = queue_.top_class();
    // State reads do not overtake each other in the slot: a reservation would be taken back each time.
    const bool urgent =
        top == TransactionClass::stop || (top == TransactionClass::motion && !current_->reserved);
    const bool overtaken = urgent && *top < current_->transaction_class;
    const bool dead = may_send(current_->exchange.guard, now) != Verdict::send;
    if ((overtaken || dead) && line_->revoke()) {
      auto revoked = std::exchange(current_, nullptr);
      if (dead) {
        const auto verdict = may_send(revoked->exchange.guard, now);
        end(std::move(revoked), not_sent(verdict, now));
      } else {
        queue_.put_back(std::move(revoked));
      }
    } else if (top == TransactionClass::stop) {
      line_->cut_wait();
    }
  }
  reap(now);
  if (!current_ && port_.open) arm_next();
}

void RtuBus::arm_next() {
  while ((current_ = queue_.pop()) && held_until(*current_)) queue_.hold(std::move(current_));
  await_release();
  if (!current_) return;
  if (current_->transaction_class != TransactionClass::stop && needs_resync(current_->exchange.request))
    current_ = resync_before(std::move(current_));
  line_->arm(current_->exchange);
}

/// Until when the quarantine of its node forbids sending it; nothing: it may be sent.
std::optional<TimePoint> RtuBus::held_until(const Transaction& transaction) const {
  using enum TransactionClass;
  if (transaction.transaction_class == stop || transaction.transaction_class == scan ||
      transaction.exchange.serial)
    return std::nullopt;
  const auto ready = quarantine_.ready_at(transaction.exchange.request.node);
  return ready > clock_->now() ? std::optional(ready) : std::nullopt;
}

/// What was put aside is looked at again as soon as the first of it may be sent.
void RtuBus::await_release() {
  auto next = TimePoint::max();
  for (const auto& held : queue_.held()) next = std::min(next, held_until(*held).value_or(clock_->now()));
  release_ = next == TimePoint::max() ? Clock::Timer{} : clock_->call_at(next, [this] {
    release_ready();
    pump();
  });
}

/// What is still held must not take a place: the queue's reservation would be spent on it.
void RtuBus::release_ready() {
  queue_.release([this](const Transaction& held) { return !held_until(held); });
}

void RtuBus::note_silence(const Transaction& ended, const ExchangeResult& result) {
  const auto node = ended.exchange.request.node;
  switch (result.status) {
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
      if (ended.transaction_class == TransactionClass::scan || ended.exchange.serial) break;
      quarantine_.silent(node, clock_->now(),
                         result.reply_end - result.request_begin + silence(settings_.serial()),
                         ended.transaction_class == TransactionClass::stop);
      break;
    case ExchangeStatus::replied:
    case ExchangeStatus::corrupt:  // somebody is there
      quarantine_.answered(node);
      release_ready();
      break;
    default:
      break;
  }
}

/// Another length than any late reply's: those are then discarded as foreign, not taken for this answer.
/// Shorter if there is such a length, else longer; an exception is as good an answer. Decided here and not
/// when the read is queued: what it waits for may time out meanwhile.
TransactionPtr RtuBus::resync_before(TransactionPtr waiting) {
  auto resync = std::make_unique<Transaction>();
  resync->transaction_class = waiting->transaction_class;
  resync->reserved = waiting->reserved;
  resync->queued_at = waiting->queued_at;
  resync->exchange = waiting->exchange;
  auto& request = resync->exchange.request;
  while (request.count > 1 && needs_resync(request)) --request.count;
  while (needs_resync(request)) ++request.count;
  constexpr int addresses = 0x10000;
  request.address = static_cast<std::uint16_t>(std::min<int>(request.address, addresses - request.count));
  const auto frame = encode(request);
  if (!frame) return waiting;  // every length that there is was tried within latest_reply
  resync->exchange.frame = *frame;
  resync->exchange.reply_timeout +=
      wire_time(resync->exchange.serial.value_or(settings_.serial()), reply_size(request)) -
      wire_time(resync->exchange.serial.value_or(settings_.serial()), reply_size(waiting->exchange.request));
  auto held = std::make_shared<TransactionPtr>(std::move(waiting));
  resync->on_end.emplace_back([this, held](const Transaction&, const ExchangeResult& result) {
    if (result.status == ExchangeStatus::replied) return queue_.put_back(std::move(*held));
    for (const auto& tell : (*held)->on_end) tell(**held, result);
  });
  return resync;
}

void RtuBus::reap(TimePoint now) {
  for (auto& transaction : queue_.take_unsendable(now)) {
    const auto verdict = may_send(transaction->exchange.guard, now);
    end(std::move(transaction), not_sent(verdict == Verdict::send ? Verdict::expired : verdict, now));
  }
  const auto next = queue_.next_deadline();
  expiry_ = next == TimePoint::max()
                ? Clock::Timer{}
                : clock_->call_at(next + std::chrono::nanoseconds(1), [this] { pump(); });
}

void RtuBus::on_result(const ExchangeResult& result) {
  auto ended = std::exchange(current_, nullptr);
  if (!ended) return;
  note_late_read(ended->exchange.request, result);
  note_garbled(ended->exchange.request, result);
  note_silence(*ended, result);
  end(std::move(ended), result);
  pump();
}

void RtuBus::note_late_read(const Request& request, const ExchangeResult& result) {
  switch (result.status) {
    case ExchangeStatus::replied:
      // Replies come in order: nothing older can follow. But the echo of a write may be that of the same
      // write before, which was late, and an exception that of any read before: its own may still come then.
      if (request.function != Function::read_holding_registers) break;
      if (result.reply.kind == ReplyKind::match)
        late_reads_.erase(request.node);
      else if (late_reads_.contains(request.node))
        late_reads_[request.node][request.count] = clock_->now() + latest_reply;
      break;
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
    case ExchangeStatus::corrupt:
      if (request.function == Function::read_holding_registers)
        late_reads_[request.node][request.count] = clock_->now() + latest_reply;
      break;
    default:
      break;
  }
}

void RtuBus::note_garbled(const Request& request, const ExchangeResult& result) {
  if (result.status == ExchangeStatus::corrupt) {
    const int in_a_row = ++garbled_[request.node];
    if (in_a_row != garbled_often) return;
    auto error = garbled_error(in_a_row);
    error.where = {.bus = settings_.name, .node = request.node};
    spdlog::warn("{}", to_string(error));
  } else if (result.status != ExchangeStatus::not_sent && result.status != ExchangeStatus::unsupported) {
    garbled_.erase(request.node);
  }
}

void RtuBus::close() {
  closed_ = true;
  on_port({.open = false, .error = Error{.reason = Reason::cancelled, .message = "the bus is being closed"}});
  if (current_ && line_->revoke())
    end(std::exchange(current_, nullptr), {.status = ExchangeStatus::not_sent});
}

void RtuBus::on_port(const PortStatus& status) {
  if (closed_ && status.open) return;
  port_ = status;
  if (port_.error) port_.error->where.bus = settings_.name;
  late_reads_.clear();
  quarantine_.forget();
  if (!port_.open) {
    // What is under way gets its own result from the line; what waits can no longer be sent in time.
    const ExchangeResult lost{.status = ExchangeStatus::not_sent, .verdict = Verdict::send};
    for (auto& transaction : queue_.take_all()) end(std::move(transaction), lost);
  }
  port_changed_.notify_all();
  pump();
}

void RtuBus::end(TransactionPtr transaction, const ExchangeResult& result) {
  statistics_.ended(*transaction, result);
  if (observer_) observer_(*transaction, result);
  for (const auto& tell : transaction->on_end) tell(*transaction, result);
}

Result<Answer> RtuBus::answer(const Transaction& transaction, const ExchangeResult& result) const {
  const auto& request = transaction.exchange.request;
  if (result.status == ExchangeStatus::replied && result.reply.kind != ReplyKind::exception)
    return Answer{.registers = result.reply.registers,
                  .sent_at = result.request_begin,
                  .request_end = result.request_end,
                  .answered_at = result.reply_end};
  auto error = error_of(transaction.exchange, result);
  error.where.bus = settings_.name;
  error.where.node = request.node;
  error.where.object = request.address;
  return fail(std::move(error));
}

Error RtuBus::error_of(const Exchange& exchange, const ExchangeResult& result) const {
  switch (result.status) {
    case ExchangeStatus::replied: {
      Error error{
          .reason = Reason::refused,
          .message = fmt::format("the node answered with exception {:02}", result.reply.exception_code),
          .outcome = Outcome::refused};
      error.where.native_code = result.reply.exception_code;
      return error;
    }
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
      return {.reason = Reason::no_reply,
              .message = "no reply",
              .remedy = "check power, wiring, address and baud rate of the node",
              .outcome = Outcome::unknown};
    case ExchangeStatus::corrupt:
      return garbled_error(garbled(exchange.request.node));
    case ExchangeStatus::unsupported:
      return {.reason = Reason::not_supported,
              .message = fmt::format("port {} cannot do {}", settings_.port,
                                     to_string(exchange.serial.value_or(settings_.serial()))),
              .remedy = "choose other settings, or another adapter"};
    case ExchangeStatus::not_sent:
      if (result.verdict != Verdict::send) return not_sent_error(result.verdict);
      return port_.error.value_or(
          Error{.reason = Reason::bus_down, .message = "the port was lost before it could be sent"});
    case ExchangeStatus::io_error:
      return {.reason = Reason::bus_down,
              .message = fmt::format("port {}: {}", settings_.port, std::strerror(result.native_error)),
              .remedy = "check the adapter; it is opened again by itself",
              .outcome = Outcome::unknown};
  }
  return {.reason = Reason::internal, .message = "unhandled exchange status"};
}

}  // namespace axisd::modbus_rtu
