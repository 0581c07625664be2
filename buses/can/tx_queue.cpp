#include "buses/can/tx_queue.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace axisd::can {
namespace {

using namespace std::chrono_literals;

constexpr Duration first_back_off = 1ms;  // some frames' time at any rate from 125 kbit/s
constexpr Duration longest_back_off = 10ms;
constexpr Duration drain_interval = 1ms;

SendStatus status_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::superseded:
      return SendStatus::superseded;
    case Verdict::expired:
      return SendStatus::expired;
    case Verdict::lease_lost:
      return SendStatus::lease_lost;
    case Verdict::send:
      break;
  }
  return SendStatus::sent;
}

/// Whether those that it concerns allow it still.
SendStatus allowed(const SendOptions& options, TimePoint now) {
  auto status = status_of(may_send(options.guard, now));
  for (const auto& guard : options.more_guards)
    if (status == SendStatus::sent) status = status_of(may_send(guard, now));
  return status;
}

/// After this nobody wants it sent.
TimePoint end_of(const SendOptions& options) {
  auto last = std::min(options.deadline, options.guard.not_after);
  for (const auto& guard : options.more_guards) last = std::min(last, guard.not_after);
  return last;
}

/// Each once.
std::set<const AxisGate*> gates_of(const SendOptions& options) {
  std::set<const AxisGate*> gates;
  if (options.guard.gate) gates.insert(options.guard.gate.get());
  for (const auto& guard : options.more_guards)
    if (guard.gate) gates.insert(guard.gate.get());
  return gates;
}

}  // namespace

/// `sent`: it may go.
SendStatus TxQueue::judge(const Waiting& waiting, TimePoint now) {
  if (now > waiting.options.deadline) return SendStatus::expired;
  return allowed(waiting.options, now);
}

void TxQueue::end(Completion completion, SendResult result) {
  ended_.push_back({.result = result, .completion = std::move(completion)});
}

void TxQueue::push(const Frame& frame, const SendOptions& options, Completion completion) {
  const bool stop = options.transaction_class == TransactionClass::stop;
  if (!valid(frame)) return end(std::move(completion), {.status = SendStatus::invalid});
  // A flood of reads must not keep a stop out: stops have as much room again.
  if (queued() >= (stop ? 2 * limit_ : limit_))
    return end(std::move(completion), {.status = SendStatus::queue_full});
  if (stop) retry_at_ = TimePoint{};
  auto& lane = lanes_.at(static_cast<std::size_t>(options.transaction_class));
  const auto place =
      lane.insert(lane.end(), {.frame = frame, .options = options, .completion = std::move(completion)});
  for (const auto* gate : gates_of(options)) guarded_[gate].push_back(place);
  if (const auto last = end_of(options); last != TimePoint::max()) ends_.emplace(last, place);
}

TxQueue::Waiting TxQueue::take(Place place) {
  for (const auto* gate : gates_of(place->options)) {
    const auto guarded = guarded_.find(gate);
    std::erase(guarded->second, place);
    if (guarded->second.empty()) guarded_.erase(guarded);
  }
  const auto [first, last] = ends_.equal_range(end_of(place->options));
  const auto ending = std::find_if(first, last, [&](const auto& one) { return one.second == place; });
  if (ending != last) ends_.erase(ending);
  auto taken = std::move(*place);
  lanes_.at(static_cast<std::size_t>(taken.options.transaction_class)).erase(place);
  return taken;
}

TxQueue::Lane* TxQueue::first_lane() {
  const auto found = std::ranges::find_if(lanes_, [](const Lane& lane) { return !lane.empty(); });
  return found == lanes_.end() ? nullptr : &*found;
}

const Frame* TxQueue::next(TimePoint now) {
  if (unconfirmed_.size() >= window_ || now < retry_at_) return nullptr;
  while (auto* lane = first_lane()) {
    // Else the kernel might never be seen without a frame.
    if (lane != &lanes_.front() && overdue(now)) return nullptr;
    const auto verdict = judge(lane->front(), now);
    if (verdict == SendStatus::sent) return &lane->front().frame;
    end(take(lane->begin()).completion, {.status = verdict});
  }
  forget_refusal();
  return nullptr;
}

void TxQueue::handed_over(TimePoint now) {
  auto waiting = take(first_lane()->begin());
  if (unconfirmed_.empty()) progress_ = now;
  unconfirmed_.push_back(
      {.frame = waiting.frame, .completion = std::move(waiting.completion), .handed_over = now});
  refused_since_.reset();
  retry_at_ = TimePoint{};
  back_off_ = Duration{};
}

void TxQueue::no_buffer(TimePoint now) {
  if (!refused_since_) refused_since_ = now;
  back_off_ = std::clamp(2 * back_off_, first_back_off, longest_back_off);
  retry_at_ = now + back_off_;
}

void TxQueue::confirm(const std::deque<Unconfirmed>::iterator& which, TimePoint at, TimePoint now) {
  progress_ = now;
  end(std::move(which->completion),
      {.status = SendStatus::sent, .handed_over = which->handed_over, .sent_at = at});
  unconfirmed_.erase(which);
}

bool TxQueue::echo(const Frame& frame, TimePoint at, TimePoint now, bool proof) {
  // Not only the oldest: a controller with several mailboxes sends what is in them by id.
  const auto found = std::ranges::find_if(
      unconfirmed_, [&](const Unconfirmed& each) { return !each.echoed && each.frame == frame; });
  if (found == unconfirmed_.end()) return false;
  looked_at_ = now;
  if (proof)
    confirm(found, at, now);
  else
    found->echoed = true;
  return true;
}

void TxQueue::drained(TimePoint now) {
  looked_at_ = now;
  for (;;) {
    const auto found = std::ranges::find_if(unconfirmed_, &Unconfirmed::echoed);
    if (found == unconfirmed_.end()) return;
    confirm(found, now, now);
  }
}

TimePoint TxQueue::oldest() const {
  const auto found = std::ranges::find_if(unconfirmed_, [](const Unconfirmed& each) { return !each.echoed; });
  return found == unconfirmed_.end() ? TimePoint::max() : found->handed_over;
}

bool TxQueue::overdue(TimePoint now) const {
  const auto since = oldest();
  return since != TimePoint::max() && now >= since + stall_timeout_;
}

void TxQueue::give_up_overdue(TimePoint now) {
  looked_at_ = now;
  std::erase_if(unconfirmed_, [&](Unconfirmed& each) {
    if (each.echoed || now < each.handed_over + stall_timeout_) return false;
    end(std::move(each.completion), {.status = SendStatus::unknown, .handed_over = each.handed_over});
    return true;
  });
}

bool TxQueue::awaits_drain() const { return std::ranges::any_of(unconfirmed_, &Unconfirmed::echoed); }

/// Nobody asks for room any more.
void TxQueue::forget_refusal() {
  if (queued() == 0) refused_since_.reset();
}

void TxQueue::reap(TimePoint now) {
  looked_at_ = now;
  while (!ends_.empty() && ends_.begin()->first < now)
    end(take(ends_.begin()->second).completion, {.status = SendStatus::expired});
  forget_refusal();
}

void TxQueue::purge_superseded(const AxisGate& gate, TimePoint now) {
  const auto guarded = guarded_.find(&gate);
  if (guarded == guarded_.end()) return;
  for (const auto place : std::vector(guarded->second)) {
    const auto status = allowed(place->options, now);
    if (status != SendStatus::sent) end(take(place).completion, {.status = status});
  }
  forget_refusal();
}

void TxQueue::end_all() {
  for (auto& each : std::exchange(unconfirmed_, {}))
    end(std::move(each.completion), {.status = SendStatus::unknown, .handed_over = each.handed_over});
  while (auto* lane = first_lane()) end(take(lane->begin()).completion, {.status = SendStatus::port_down});
  forget_refusal();
  retry_at_ = TimePoint{};
  back_off_ = Duration{};
}

TimePoint TxQueue::stalls_at() const {
  auto at = TimePoint::max();
  if (!unconfirmed_.empty()) at = progress_ + stall_timeout_;
  if (const auto since = oldest(); since != TimePoint::max()) at = std::min(at, since + 2 * stall_timeout_);
  if (refused_since_) at = std::min(at, *refused_since_ + stall_timeout_);
  return at;
}

bool TxQueue::stalled(TimePoint now) const { return now >= stalls_at(); }

TimePoint TxQueue::next_event() const {
  auto at = stalls_at();
  if (awaits_drain()) at = std::min(at, looked_at_ + drain_interval);
  if (const auto since = oldest(); since != TimePoint::max())
    at = std::min(at, std::max(since + stall_timeout_, looked_at_ + drain_interval));
  const bool waits = queued() > 0;
  if (waits && unconfirmed_.size() < window_ && retry_at_ > TimePoint{}) at = std::min(at, retry_at_);
  // The deadline itself is still in time.
  if (!ends_.empty()) at = std::min(at, ends_.begin()->first + Duration(1));
  return at;
}

std::vector<TxQueue::Ended> TxQueue::take_ended() { return std::exchange(ended_, {}); }

std::size_t TxQueue::queued() const {
  std::size_t count = 0;
  for (const auto& lane : lanes_) count += lane.size();
  return count;
}

}  // namespace axisd::can
