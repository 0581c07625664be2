#include "buses/modbus_rtu/rtu_bus.hpp"

#include <fmt/format.h>

#include <cstring>
#include <utility>

namespace axisd::modbus_rtu {

namespace {

/// Margin for the operating system and USB adapters on top of what the wire and the node take.
constexpr auto timeout_margin = std::chrono::milliseconds(10);

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

}  // namespace

RtuBus::RtuBus(Executor executor, Clock& clock, LineSettings settings, std::unique_ptr<Line> line)
    : executor_(std::move(executor)),
      clock_(&clock),
      settings_(std::move(settings)),
      line_(std::move(line)),
      port_changed_(executor_, clock) {}

RtuBus::~RtuBus() = default;

void RtuBus::start(ExchangeObserver observer) {
  observer_ = std::move(observer);
  line_->start([this](const ExchangeResult& result) { on_result(result); },
               [this](const PortStatus& status) { on_port(status); });
}

bool RtuBus::needs_resync(const Request& request) const {
  const auto late = late_reads_.find(request.node);
  return late != late_reads_.end() && request.function == Function::read_holding_registers &&
         request.count > 1 && late->second.contains(request.count);
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
  auto transaction = std::make_unique<Transaction>();
  transaction->transaction_class = options.transaction_class;
  transaction->exchange = {
      .request = request,
      .frame = *frame,
      .guard = std::move(options.guard),
      .deadline = options.deadline,
      .reply_timeout = settings_.turnaround_max + wire_time(settings_, reply_size(request)) + timeout_margin,
      .turnaround_max = settings_.turnaround_max};

  Promise<Result<Answer>> promise(executor_, *clock_);
  transaction->on_end.emplace_back([this, &promise](const Transaction& ended, const ExchangeResult& result) {
    promise.set(answer(ended, result));
  });
  queue_.push(std::move(transaction));
  pump();
  co_return co_await promise.get();
}

void RtuBus::purge_superseded() { pump(); }

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
  current_ = queue_.pop();
  if (!current_) return;
  if (current_->transaction_class != TransactionClass::stop && needs_resync(current_->exchange.request))
    current_ = resync_before(std::move(current_));
  line_->arm(current_->exchange);
}

/// Another length than any late reply's: those are then discarded as foreign, not taken for this answer.
/// Decided here and not when the read is queued: what it waits for may time out meanwhile.
TransactionPtr RtuBus::resync_before(TransactionPtr waiting) {
  auto resync = std::make_unique<Transaction>();
  resync->transaction_class = waiting->transaction_class;
  resync->reserved = waiting->reserved;
  resync->exchange = waiting->exchange;
  auto& request = resync->exchange.request;
  while (request.count > 1 && needs_resync(request)) --request.count;
  resync->exchange.frame = *encode(request);
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
  if (observer_) observer_(settings_.name, ended->exchange, result);
  note_late_read(ended->exchange.request, result);
  end(std::move(ended), result);
  pump();
}

void RtuBus::note_late_read(const Request& request, const ExchangeResult& result) {
  switch (result.status) {
    case ExchangeStatus::replied:
      late_reads_.erase(request.node);  // replies come in order: nothing older can follow
      break;
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
    case ExchangeStatus::corrupt:
      if (request.function == Function::read_holding_registers)
        late_reads_[request.node].insert(request.count);
      break;
    default:
      break;
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
  if (!port_.open) {
    // What is under way gets its own result from the line; what waits can no longer be sent in time.
    const ExchangeResult lost{.status = ExchangeStatus::not_sent, .verdict = Verdict::send};
    for (auto& transaction : queue_.take_all()) end(std::move(transaction), lost);
  }
  port_changed_.notify_all();
  pump();
}

void RtuBus::end(TransactionPtr transaction, const ExchangeResult& result) {
  count(result);
  for (const auto& tell : transaction->on_end) tell(*transaction, result);
}

void RtuBus::count(const ExchangeResult& result) {
  counters_.foreign_frames += static_cast<std::uint64_t>(result.foreign_frames);
  switch (result.status) {
    case ExchangeStatus::replied:
      ++counters_.transactions;
      if (result.reply.kind == ReplyKind::exception) ++counters_.exceptions;
      break;
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
      ++counters_.timeouts;
      break;
    case ExchangeStatus::corrupt:
      ++counters_.corrupt;
      break;
    case ExchangeStatus::not_sent:
      ++(result.verdict == Verdict::expired ? counters_.dropped_expired : counters_.dropped_superseded);
      break;
    case ExchangeStatus::io_error:
      ++counters_.io_errors;
      break;
  }
}

Result<Answer> RtuBus::answer(const Transaction& transaction, const ExchangeResult& result) const {
  const auto& request = transaction.exchange.request;
  const Address where{.bus = settings_.name, .node = request.node, .object = request.address};
  const auto with_address = [&](Error error) {
    error.where.bus = where.bus;
    error.where.node = where.node;
    error.where.object = where.object;
    return fail(std::move(error));
  };
  switch (result.status) {
    case ExchangeStatus::replied:
      if (result.reply.kind == ReplyKind::exception) {
        auto error = Error{
            .reason = Reason::refused,
            .message = fmt::format("the node answered with exception {:02}", result.reply.exception_code),
            .outcome = Outcome::refused};
        error.where.native_code = result.reply.exception_code;
        return with_address(std::move(error));
      }
      return Answer{.registers = result.reply.registers,
                    .sent_at = result.request_begin,
                    .answered_at = result.reply_end};
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
      return with_address({.reason = Reason::no_reply,
                           .message = "no reply",
                           .remedy = "check power, wiring, address and baud rate of the node",
                           .outcome = Outcome::unknown});
    case ExchangeStatus::corrupt:
      return with_address({.reason = Reason::no_reply,
                           .message = "only damaged bytes came back",
                           .remedy = "check termination, shielding and that no address is used twice",
                           .outcome = Outcome::unknown});
    case ExchangeStatus::not_sent:
      if (result.verdict == Verdict::send)
        return with_address(port_.error.value_or(
            Error{.reason = Reason::bus_down, .message = "the port was lost before it could be sent"}));
      return with_address(not_sent_error(result.verdict));
    case ExchangeStatus::io_error:
      return with_address(
          {.reason = Reason::bus_down,
           .message = fmt::format("port {}: {}", settings_.port, std::strerror(result.native_error)),
           .remedy = "check the adapter; it is opened again by itself",
           .outcome = Outcome::unknown});
  }
  return with_address({.reason = Reason::internal, .message = "unhandled exchange status"});
}

}  // namespace axisd::modbus_rtu
