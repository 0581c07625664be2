#include "buses/modbus_rtu/transaction_queue.hpp"

#include <algorithm>
#include <utility>

namespace axisd::modbus_rtu {

namespace {

bool is_read(const Transaction& transaction) {
  return transaction.exchange.request.function == Function::read_holding_registers;
}

bool sends_the_same(const Transaction& a, const Transaction& b) {
  return a.exchange.frame == b.exchange.frame && !a.exchange.guard.gate && !b.exchange.guard.gate &&
         a.exchange.serial == b.exchange.serial && a.exchange.reply_timeout == b.exchange.reply_timeout &&
         a.exchange.turnaround_max == b.exchange.turnaround_max;
}

bool before(const TransactionPtr& a, const TransactionPtr& b) {
  return std::pair(a->exchange.deadline, a->sequence) < std::pair(b->exchange.deadline, b->sequence);
}

}  // namespace

void TransactionQueue::push(TransactionPtr transaction) {
  transaction->sequence = ++last_sequence_;
  if (is_read(*transaction) && merge(*transaction)) return;
  insert(std::move(transaction));
}

void TransactionQueue::put_back(TransactionPtr transaction) { insert(std::move(transaction)); }

bool TransactionQueue::merge(Transaction& transaction) {
  for (auto& known_lane : lanes_) {
    const auto found = std::ranges::find_if(
        known_lane, [&](const auto& known) { return sends_the_same(*known, transaction); });
    if (found == known_lane.end()) continue;
    auto known = std::move(*found);
    known_lane.erase(found);
    std::ranges::move(transaction.on_end, std::back_inserter(known->on_end));
    known->transaction_class = std::min(known->transaction_class, transaction.transaction_class);
    // The later deadline: an answer that still serves one of them is worth sending for.
    known->exchange.deadline = std::max(known->exchange.deadline, transaction.exchange.deadline);
    insert(std::move(known));
    return true;
  }
  return false;
}

void TransactionQueue::insert(TransactionPtr transaction) {
  auto& target = lane(transaction->transaction_class);
  target.insert(std::ranges::upper_bound(target, transaction, before), std::move(transaction));
}

TransactionPtr TransactionQueue::pop() {
  const auto first = std::ranges::find_if(lanes_, [](const Lane& lane) { return !lane.empty(); });
  if (first == lanes_.end()) return nullptr;
  auto* chosen = &*first;
  const bool stop_waits = first == lanes_.begin();
  auto* lower = stop_waits ? nullptr : next_below(static_cast<std::size_t>(first - lanes_.begin()));
  const bool reserved = lower != nullptr && ++popped_since_reservation_ >= reservation_;
  if (reserved) {
    popped_since_reservation_ = 0;
    last_reserved_ = static_cast<std::size_t>(lower - lanes_.data());
    chosen = lower;
  }
  auto transaction = std::move(chosen->front());
  chosen->pop_front();
  transaction->reserved = reserved;
  return transaction;
}

/// The waiting class below `top` whose turn it is: the first one after the last that had a reservation.
TransactionQueue::Lane* TransactionQueue::next_below(std::size_t top) {
  const auto below = lanes_.size() - top - 1;
  const auto start = last_reserved_ > top ? last_reserved_ - top : 0;
  for (std::size_t step = 0; step < below; ++step) {
    auto& candidate = lanes_.at(top + 1 + (start + step) % below);
    if (!candidate.empty()) return &candidate;
  }
  return nullptr;
}

void TransactionQueue::hasten(std::uint8_t node, TransactionClass to) {
  for (auto& held : held_)
    if (held->exchange.request.node == node) held->transaction_class = std::min(held->transaction_class, to);
  for (auto index = static_cast<std::size_t>(to) + 1; index < lanes_.size(); ++index) {
    std::vector<TransactionPtr> hastened;
    for (auto& transaction : lanes_.at(index))
      if (transaction->exchange.request.node == node) hastened.push_back(std::move(transaction));
    std::erase(lanes_.at(index), nullptr);
    for (auto& transaction : hastened) {
      transaction->transaction_class = to;
      insert(std::move(transaction));
    }
  }
}

std::optional<TransactionClass> TransactionQueue::top_class() const {
  for (const auto& candidate : lanes_)
    if (!candidate.empty()) return candidate.front()->transaction_class;
  return std::nullopt;
}

std::vector<TransactionPtr> TransactionQueue::take_unsendable(TimePoint now) {
  std::vector<TransactionPtr> taken;
  for (auto& candidate : lanes_) take_unsendable(candidate, now, taken);
  take_unsendable(held_, now, taken);
  return taken;
}

void TransactionQueue::take_unsendable(auto& from, TimePoint now, std::vector<TransactionPtr>& into) {
  for (auto& transaction : from)
    if (transaction->exchange.deadline < now || may_send(transaction->exchange.guard, now) != Verdict::send)
      into.push_back(std::move(transaction));
  std::erase(from, nullptr);
}

void TransactionQueue::release(const std::function<bool(const Transaction&)>& ready) {
  for (auto& transaction : held_)
    if (ready(*transaction)) insert(std::move(transaction));
  std::erase(held_, nullptr);
}

std::vector<TransactionPtr> TransactionQueue::take_all() {
  auto taken = std::exchange(held_, {});
  for (auto& candidate : lanes_) {
    std::ranges::move(candidate, std::back_inserter(taken));
    candidate.clear();
  }
  return taken;
}

TimePoint TransactionQueue::next_deadline() const {
  auto earliest = TimePoint::max();
  for (const auto& candidate : lanes_)
    if (!candidate.empty()) earliest = std::min(earliest, candidate.front()->exchange.deadline);
  for (const auto& held : held_) earliest = std::min(earliest, held->exchange.deadline);
  return earliest;
}

std::size_t TransactionQueue::size() const {
  std::size_t total = held_.size();
  for (const auto& candidate : lanes_) total += candidate.size();
  return total;
}

}  // namespace axisd::modbus_rtu
