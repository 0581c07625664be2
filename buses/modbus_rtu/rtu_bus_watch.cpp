// Readings that are repeated without whoever asked for them.
#include <algorithm>
#include <utility>

#include "buses/modbus_rtu/rtu_bus.hpp"

namespace axisd::modbus_rtu {

namespace {

/// So much later than by itself the core hears of a reading that says nothing new, and of what was carried
/// out behind it.
constexpr Duration longest_round = std::chrono::milliseconds(100);

}  // namespace

Task<Result<std::optional<Answer>>> RtuBus::watch(Request request, Repetition repetition) {
  const auto node = request.node;
  const TransactionOptions options{.transaction_class = TransactionClass::idle_state};
  auto transaction = prepare(std::move(request), options);
  if (!transaction) co_return fail(transaction.error());
  std::optional<Exchange> proof;
  if (repetition.proof) {
    const auto prepared = prepare(std::move(repetition.proof->request), options);
    if (!prepared) co_return fail(prepared.error());
    proof = (*prepared)->exchange;
  }
  Promise<Result<std::optional<Answer>>> promise(executor_, *clock_);
  Watch* watch = nullptr;
  if (auto& own = watches_[node]; !own) {
    auto& of_node = known_[node];
    if (!of_node) of_node = std::make_unique<KnownOfNode>();
    auto& [known_reading, known_proof] = *of_node;
    know((*transaction)->exchange, known_reading);
    if (proof) know(*proof, known_proof);
    own = std::make_unique<Watch>(std::move(repetition), std::move(proof),
                                  [&promise] { promise.set(std::nullopt); });
    (*transaction)->watch = watch = own.get();
  }
  (*transaction)
      ->on_end.emplace_back([this, &promise, watch](const Transaction& ended, const ExchangeResult& result) {
        auto told = answer(ended, result);
        // It was a reading that was asked for.
        if (watch != nullptr && watch->proves() && told)
          promise.set(std::nullopt);
        else
          promise.set(std::move(told));
      });
  submit(*std::move(transaction));
  pump();
  auto result = co_await promise.get();
  if (watch != nullptr) watches_[node].reset();
  co_return result;
}

Watch* RtuBus::watch_of(std::uint8_t node) const {
  const auto* found = watches_.find(node);
  return found == nullptr ? nullptr : found->get();
}

/// From now on `exchange` is compared with what `known` holds.
void RtuBus::know(Exchange& exchange, Known& known) {
  if (known.request != exchange.frame) known = {.request = exchange.frame};
  exchange.known = &known.reply;
}

/// Whoever ends it waits for its answer: it is not to be told with those of the round only.
void RtuBus::end_repetition(std::uint8_t node) {
  auto* const watch = watch_of(node);
  if (watch == nullptr) return;
  watch->end();
  if (recall(node)) pump();
}

/// Takes a round back of which `node` is part, as far as it has not been carried out.
bool RtuBus::recall(std::uint8_t node) {
  return round_.size() > 1 &&
         std::ranges::any_of(round_, [&](const auto& one) { return one->exchange.request.node == node; }) &&
         take_back();
}

/// Whoever asked: a later reading that says the same says nothing new.
void RtuBus::note_known(const Exchange& exchange, const ExchangeResult& result) {
  if (result.status != ExchangeStatus::replied || result.reply.kind != ReplyKind::match) return;
  if (exchange.known != nullptr && *exchange.known == result.reply_frame) return;
  const auto* of_node = known_.find(exchange.request.node);
  if (of_node == nullptr) return;
  for (auto& known : **of_node)
    if (known.request == exchange.frame) known.reply = result.reply_frame;
}

/// What was hastened has somebody waiting.
bool RtuBus::is_repeated(const Transaction& ended, const ExchangeResult& result) const {
  const bool awaited = ended.transaction_class != TransactionClass::idle_state;
  if (ended.watch == nullptr || result.status != ExchangeStatus::replied ||
      result.reply.kind != ReplyKind::match || !port_.open || (awaited && !ended.watch->proves()))
    return false;
  const Registers registers(result.reply_frame);
  return ended.watch->goes_on({.registers = registers.values(),
                               .sent_at = result.request_begin,
                               .answered_at = result.reply_end}) &&
         !awaited;
}

/// Puts what is next behind the first one, as long as nothing but axes at rest is asked for: to wake the core
/// for each of them costs as much as the exchange. One that somebody waits for is the last.
void RtuBus::extend_round() {
  const auto now = clock_->now();
  const auto length_of = [this](const Transaction& one) {
    return silence(settings_.serial()) + wire_time(settings_.serial(), one.exchange.frame.size()) +
           wire_time(settings_.serial(), reply_size(one.exchange.request));
  };
  Duration length{};
  for (auto* last = round_.front().get();; last = round_.back().get()) {
    last->exchange.then = nullptr;
    length += length_of(*last);
    if (last->watch == nullptr || last->watch->over() ||
        last->transaction_class != TransactionClass::idle_state)
      return;
    const auto* next = queue_.next_idle();
    if (next == nullptr || length + length_of(*next) > longest_round || next->exchange.serial ||
        may_send(next->exchange.guard, now) != Verdict::send || must_wait(*next, now) ||
        late_.may_answer(next->exchange.request, now))
      return;
    round_.push_back(queue_.pop());
    last->exchange.then = &round_.back()->exchange;
    last->exchange.round_longest = longest_round;
  }
}

/// The same transaction once more, or its proof, behind what waits by then.
void RtuBus::repeat(TransactionPtr transaction, const ExchangeResult& result, TimePoint now) {
  note(*transaction, result);
  auto* watch = transaction->watch;
  const auto waited = std::max(result.request_begin - transaction->queued_at, Duration::zero());
  const auto due = std::max(watch->turn(*transaction, waited), now);
  transaction->reserved = false;
  transaction->queued_at = due;
  if (due == now) return submit(std::move(transaction));
  watch->rest(std::move(transaction), clock_->call_at(due, [this, watch] {
    submit(watch->take_resting());
    pump();
  }));
}

}  // namespace axisd::modbus_rtu
