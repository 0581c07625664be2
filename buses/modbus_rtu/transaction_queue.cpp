#include "buses/modbus_rtu/transaction_queue.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace axisd::modbus_rtu {

namespace {

bool is_read(const Transaction& transaction) {
  return transaction.exchange.request.function == Function::read_holding_registers;
}

bool is_stop(const Transaction& transaction) {
  return transaction.transaction_class == TransactionClass::stop;
}

bool sends_the_same(const Transaction& a, const Transaction& b) {
  return a.exchange.frame == b.exchange.frame && !a.exchange.guard.gate && !b.exchange.guard.gate &&
         a.of_others == b.of_others && a.exchange.serial == b.exchange.serial &&
         a.exchange.reply_timeout == b.exchange.reply_timeout &&
         a.exchange.turnaround_max == b.exchange.turnaround_max;
}

/// After this nobody wants it sent.
TimePoint expiry_of(const Transaction& transaction) {
  return std::min(transaction.exchange.deadline, transaction.exchange.guard.not_after);
}

}  // namespace

bool TransactionQueue::Order::before(const Transaction& a, const Transaction& b) {
  const auto turn = [](const Transaction& one) {
    if (lane_class(one) != TransactionClass::stop) return TimePoint{};
    return one.queued_at + (one.doubtful ? doubtful_patience : Duration{});
  };
  return std::tuple(a.exchange.deadline, turn(a), a.sequence) <
         std::tuple(b.exchange.deadline, turn(b), b.sequence);
}

bool TransactionQueue::Order::operator()(const TransactionPtr& a, const TransactionPtr& b) const {
  return before(*a, *b);
}

bool TransactionQueue::has_stop_before(const Transaction& other) const {
  const auto& stops = lanes_.front();
  return !stops.empty() &&
         (lane_class(other) != TransactionClass::stop || Order::before(**stops.begin(), other));
}

void TransactionQueue::push(TransactionPtr transaction) {
  transaction->sequence = ++last_sequence_;
  push_again(std::move(transaction));
}

void TransactionQueue::push_again(TransactionPtr transaction) {
  // An axis whose node has fallen silent may have two stops waiting, one that is owed and one that was asked
  // for since: twice as many frames as the published bound of a stop of all axes counts.
  if ((is_read(*transaction) || is_stop(*transaction)) && merge(*transaction)) return;
  insert(std::move(transaction), false);
}

void TransactionQueue::put_back(TransactionPtr transaction) {
  transaction->reserved = false;
  insert(std::move(transaction), false);
}

void TransactionQueue::hold(TransactionPtr transaction) { insert(std::move(transaction), true); }

bool TransactionQueue::merge(Transaction& transaction) {
  const auto* waiting = by_node_.find(transaction.exchange.request.node);
  if (waiting == nullptr) return false;
  const auto found = std::ranges::find_if(
      *waiting, [&](const Place& one) { return !one.held && sends_the_same(*one.transaction, transaction); });
  if (found == waiting->end()) return false;
  auto known = take(found->transaction);
  known->watch = nullptr;  // somebody waits for it
  std::ranges::move(transaction.on_end, std::back_inserter(known->on_end));
  known->transaction_class = std::min(known->transaction_class, transaction.transaction_class);
  known->awaited_from = std::min(known->awaited_from, transaction.awaited_from);
  known->patient = known->patient && transaction.patient;
  known->doubtful = known->doubtful && transaction.doubtful;
  // The later deadline: an answer that still serves one of them is worth sending for.
  known->exchange.deadline = std::max(known->exchange.deadline, transaction.exchange.deadline);
  insert(std::move(known), false);
  return true;
}

void TransactionQueue::insert(TransactionPtr transaction, bool held) {
  auto* one = transaction.get();
  if (one->sequence == 0) one->sequence = ++last_sequence_;
  const auto node = one->exchange.request.node;
  if (const auto* gate = one->exchange.guard.gate.get()) guarded_[gate].push_back(one);
  if (const auto expiry = expiry_of(*one); expiry != TimePoint::max())
    expiries_.emplace(std::pair(expiry, one->sequence), one);
  Place place{.transaction = one, .held = held};
  if (held)
    held_[node].push_back(std::move(transaction));
  else
    place.in_lane = lane(lane_class(*one)).insert(std::move(transaction)).first;
  auto& places = by_node_[node];
  places.insert(std::ranges::upper_bound(places, one->sequence, {}, sequence_of), place);
}

TransactionPtr TransactionQueue::take(Transaction* transaction) {
  const auto node = transaction->exchange.request.node;
  auto& places = by_node_[node];
  const auto found_place = std::ranges::lower_bound(places, transaction->sequence, {}, sequence_of);
  const auto place = *found_place;
  places.erase(found_place);
  expiries_.erase({expiry_of(*transaction), transaction->sequence});
  if (const auto guarded = guarded_.find(transaction->exchange.guard.gate.get()); guarded != guarded_.end()) {
    std::erase(guarded->second, transaction);
    if (guarded->second.empty()) guarded_.erase(guarded);
  }
  if (!place.held) return std::move(lane(lane_class(*transaction)).extract(place.in_lane).value());
  auto& aside = held_.at(node);
  const auto found = std::ranges::find(aside, transaction, &TransactionPtr::get);
  auto taken = std::move(*found);
  aside.erase(found);
  if (aside.empty()) held_.erase(node);
  return taken;
}

TransactionPtr TransactionQueue::pop(std::optional<TimePoint> awaited_by) {
  constexpr auto motion = static_cast<std::size_t>(TransactionClass::motion),
                 readings = static_cast<std::size_t>(TransactionClass::moving_state);
  const auto top = first_class();
  if (top == lanes_.size()) return nullptr;
  const bool before_motion = top == motion && awaited_by && is_awaited(*awaited_by);
  auto transaction =
      before_motion ? give(readings, next_awaited(*awaited_by)) : give(top, lanes_.at(top).begin()->get());
  transaction->reserved |= before_motion;
  note_passing(*transaction);
  return transaction;
}

TransactionPtr TransactionQueue::pop(TransactionClass lowest) {
  if (lowest == TransactionClass::scan) return pop();
  const auto top = first_class();
  if (top > static_cast<std::size_t>(lowest)) return nullptr;
  auto transaction = take(lanes_.at(top).begin()->get());
  transaction->reserved = false;
  note_passing(*transaction);
  return transaction;
}

/// The highest class of which something waits, or the number of classes.
std::size_t TransactionQueue::first_class() const {
  const auto first = std::ranges::find_if(lanes_, [](const Lane& lane) { return !lane.empty(); });
  return static_cast<std::size_t>(first - lanes_.begin());
}

/// `first`, which is of class `top`, or the next one of a class below it that has the reservation.
TransactionPtr TransactionQueue::give(std::size_t top, Transaction* first) {
  constexpr auto stop = static_cast<std::size_t>(TransactionClass::stop);
  auto* lower = top == stop ? nullptr : next_below(top);
  const bool reserved = lower != nullptr && ++popped_since_reservation_ >= reservation_;
  if (reserved) {
    popped_since_reservation_ = 0;
    last_reserved_ = static_cast<std::size_t>(lower - lanes_.data());
    first = lower->begin()->get();
  }
  auto transaction = take(first);
  transaction->reserved = reserved;
  return transaction;
}

bool TransactionQueue::is_awaited(TimePoint by) const {
  return std::ranges::any_of(lanes_.at(static_cast<std::size_t>(TransactionClass::moving_state)),
                             [by](const TransactionPtr& one) { return one->awaited_from <= by; });
}

/// The reading that is awaited longest by then, of those that may go before all that came before them; else
/// the next one of its class. Precondition: one is awaited.
Transaction* TransactionQueue::next_awaited(TimePoint by) const {
  const auto& readings = lanes_.at(static_cast<std::size_t>(TransactionClass::moving_state));
  Transaction* next = nullptr;
  std::bitset<256> passed;  // whoever waits before it: by these nodes, or one of theirs does
  for (const auto& one : readings) {
    const auto node = one->exchange.request.node;
    const bool sooner = next == nullptr || one->awaited_from < next->awaited_from;
    if (one->awaited_from <= by && sooner && !passed.test(node)) next = one.get();
    passed |= one->passed_by;
    passed.set(node);
  }
  return next == nullptr ? readings.begin()->get() : next;
}

void TransactionQueue::note_passing(const Transaction& gone) {
  if (lane_class(gone) != TransactionClass::moving_state) return;
  for (const auto& one : lane(TransactionClass::moving_state)) one->passed_by.set(gone.exchange.request.node);
}

bool TransactionQueue::all_of(TransactionClass transaction_class,
                              const std::function<bool(const Transaction&)>& holds) const {
  return std::ranges::all_of(lanes_.at(static_cast<std::size_t>(transaction_class)),
                             [&holds](const TransactionPtr& one) { return holds(*one); });
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
  const auto* waiting = by_node_.find(node);
  if (waiting == nullptr) return;
  std::vector<Place> late;
  for (const auto& place : *waiting)
    if (!place.transaction->of_others && place.transaction->transaction_class > to) late.push_back(place);
  for (const auto& place : late) {
    auto hastened = take(place.transaction);
    hastened->transaction_class = to;
    insert(std::move(hastened), place.held);
  }
}

bool TransactionQueue::only_idle() const {
  const auto* const idle = &lanes_.at(static_cast<std::size_t>(TransactionClass::idle_state));
  return std::ranges::all_of(lanes_, [&](const Lane& lane) { return &lane == idle || lane.empty(); });
}

const Transaction* TransactionQueue::next_idle() const {
  const auto& idle = lanes_.at(static_cast<std::size_t>(TransactionClass::idle_state));
  return idle.empty() || !only_idle() ? nullptr : idle.begin()->get();
}

std::optional<TransactionClass> TransactionQueue::top_class() const {
  for (const auto& candidate : lanes_)
    if (!candidate.empty()) return lane_class(**candidate.begin());
  return std::nullopt;
}

std::vector<TransactionPtr> TransactionQueue::take_forbidden(const AxisGate& gate, TimePoint now) {
  std::vector<TransactionPtr> taken;
  const auto guarded = guarded_.find(&gate);
  if (guarded == guarded_.end()) return taken;
  for (auto* transaction : std::vector(guarded->second))
    if (may_send(transaction->exchange.guard, now) != Verdict::send) taken.push_back(take(transaction));
  return taken;
}

std::vector<TransactionPtr> TransactionQueue::take_reads(std::uint8_t node, TransactionClass lowest) {
  std::vector<TransactionPtr> taken;
  const auto* waiting = by_node_.find(node);
  if (waiting == nullptr) return taken;
  std::vector<Transaction*> reads;
  for (const auto& place : *waiting)
    if (is_read(*place.transaction) && !place.transaction->of_others &&
        place.transaction->transaction_class <= lowest)
      reads.push_back(place.transaction);
  for (auto* read : reads) taken.push_back(take(read));
  return taken;
}

std::vector<TransactionPtr> TransactionQueue::take_expired(TimePoint now) {
  std::vector<TransactionPtr> taken;
  while (next_expiry() < now) taken.push_back(take(expiries_.begin()->second));
  return taken;
}

void TransactionQueue::release(std::uint8_t node, TimePoint now) {
  const auto found = held_.find(node);
  if (found == held_.end()) return;
  std::vector<Transaction*> aside;
  aside.reserve(found->second.size());
  for (const auto& one : found->second) aside.push_back(one.get());
  for (auto* transaction : aside) {
    transaction->released_at = now;
    insert(take(transaction), false);
  }
}

std::vector<std::uint8_t> TransactionQueue::held_nodes() const {
  std::vector<std::uint8_t> nodes;
  nodes.reserve(held_.size());
  for (const auto& [node, aside] : held_) nodes.push_back(node);
  return nodes;
}

std::vector<TransactionPtr> TransactionQueue::take_all() {
  std::vector<Transaction*> all;
  for (const auto& [node, places] : by_node_)
    for (const auto& place : places) all.push_back(place.transaction);
  std::vector<TransactionPtr> taken;
  taken.reserve(all.size());
  for (auto* transaction : all) taken.push_back(take(transaction));
  return taken;
}

TimePoint TransactionQueue::next_expiry() const {
  return expiries_.empty() ? TimePoint::max() : expiries_.begin()->first.first;
}

std::size_t TransactionQueue::size() const {
  std::size_t total = 0;
  for (const auto& [node, aside] : held_) total += aside.size();
  for (const auto& candidate : lanes_) total += candidate.size();
  return total;
}

}  // namespace axisd::modbus_rtu
