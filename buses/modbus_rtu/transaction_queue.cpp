#include "buses/modbus_rtu/transaction_queue.hpp"

#include <algorithm>
#include <utility>

namespace axisd::modbus_rtu {

namespace {

bool is_read(const Transaction& transaction) {
  return transaction.exchange.request.function == Function::read_holding_registers;
}

bool sends_the_same(const Transaction& a, const Transaction& b) {
  return a.exchange.frame == b.exchange.frame && !a.exchange.guard.gate && !b.exchange.guard.gate;
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
  Lane* first = nullptr;
  Lane* second = nullptr;  // highest waiting class below the first
  for (auto& candidate : lanes_) {
    if (candidate.empty()) continue;
    if (first == nullptr) {
      first = &candidate;
    } else {
      second = &candidate;
      break;
    }
  }
  if (first == nullptr) return nullptr;
  auto* chosen = first;
  const bool stop_waits = first == &lane(TransactionClass::stop);
  if (second != nullptr && !stop_waits && ++popped_since_reservation_ >= reservation_) {
    popped_since_reservation_ = 0;
    chosen = second;
  }
  auto transaction = std::move(chosen->front());
  chosen->pop_front();
  return transaction;
}

std::optional<TransactionClass> TransactionQueue::top_class() const {
  for (const auto& candidate : lanes_)
    if (!candidate.empty()) return candidate.front()->transaction_class;
  return std::nullopt;
}

std::vector<TransactionPtr> TransactionQueue::take_unsendable(TimePoint now) {
  std::vector<TransactionPtr> taken;
  for (auto& candidate : lanes_) {
    const auto unsendable = [now](const TransactionPtr& transaction) {
      return transaction->exchange.deadline < now ||
             may_send(transaction->exchange.guard, now) != Verdict::send;
    };
    for (auto& transaction : candidate)
      if (unsendable(transaction)) taken.push_back(std::move(transaction));
    std::erase(candidate, nullptr);
  }
  return taken;
}

std::vector<TransactionPtr> TransactionQueue::take_all() {
  std::vector<TransactionPtr> taken;
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
  return earliest;
}

std::size_t TransactionQueue::size() const {
  std::size_t total = 0;
  for (const auto& candidate : lanes_) total += candidate.size();
  return total;
}

}  // namespace axisd::modbus_rtu
