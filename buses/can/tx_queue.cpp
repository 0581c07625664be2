#include "buses/can/tx_queue.hpp"

#include <algorithm>
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
  lanes_.at(static_cast<std::size_t>(options.transaction_class))
      .push_back({.frame = frame, .options = options, .completion = std::move(completion)});
}

TxQueue::Lane* TxQueue::first_lane() {
  const auto found = std::ranges::find_if(lanes_, [](const Lane& lane) { return !lane.empty(); });
  return found == lanes_.end() ? nullptr : &*found;
}

const Frame* TxQueue::next(TimePoint now) {
  if (unconfirmed_.size() >= window_ || now < retry_at_) return nullptr;
  while (auto* lane = first_lane()) {
    const auto verdict = judge(lane->front(), now);
    if (verdict == SendStatus::sent) return &lane->front().frame;
    end(std::move(lane->front().completion), {.status = verdict});
    lane->pop_front();
  }
  forget_refusal();
  return nullptr;
}

void TxQueue::handed_over(TimePoint now) {
  auto* lane = first_lane();
  if (unconfirmed_.empty()) progress_ = now;
  unconfirmed_.push_back(
      {.frame = lane->front().frame, .completion = std::move(lane->front().completion), .handed_over = now});
  lane->pop_front();
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

bool TxQueue::awaits_drain() const { return std::ranges::any_of(unconfirmed_, &Unconfirmed::echoed); }

/// Nobody asks for room any more.
void TxQueue::forget_refusal() {
  if (queued() == 0) refused_since_.reset();
}

template <class Predicate>
void TxQueue::end_where(Predicate status_of_waiting) {
  for (auto& lane : lanes_) {
    std::erase_if(lane, [&](Waiting& waiting) {
      const auto status = status_of_waiting(waiting);
      if (status == SendStatus::sent) return false;
      end(std::move(waiting.completion), {.status = status});
      return true;
    });
  }
  forget_refusal();
}

void TxQueue::reap(TimePoint now) {
  looked_at_ = now;
  end_where([&](const Waiting& waiting) { return judge(waiting, now); });
}

void TxQueue::purge_superseded(TimePoint now) {
  end_where([&](const Waiting& waiting) { return allowed(waiting.options, now); });
}

void TxQueue::end_all() {
  for (auto& each : std::exchange(unconfirmed_, {}))
    end(std::move(each.completion), {.status = SendStatus::unknown, .handed_over = each.handed_over});
  end_where([](const Waiting&) { return SendStatus::port_down; });
  retry_at_ = TimePoint{};
  back_off_ = Duration{};
}

TimePoint TxQueue::stalls_at() const {
  auto at = TimePoint::max();
  if (!unconfirmed_.empty()) at = progress_ + stall_timeout_;
  if (refused_since_) at = std::min(at, *refused_since_ + stall_timeout_);
  return at;
}

bool TxQueue::stalled(TimePoint now) const { return now >= stalls_at(); }

TimePoint TxQueue::next_event() const {
  auto at = stalls_at();
  if (awaits_drain()) at = std::min(at, looked_at_ + drain_interval);
  const bool waits = queued() > 0;
  if (waits && unconfirmed_.size() < window_ && retry_at_ > TimePoint{}) at = std::min(at, retry_at_);
  for (const auto& lane : lanes_) {
    for (const auto& waiting : lane) {
      auto end = std::min(waiting.options.deadline, waiting.options.guard.not_after);
      for (const auto& guard : waiting.options.more_guards) end = std::min(end, guard.not_after);
      if (end != TimePoint::max())
        at = std::min(at, end + Duration(1));  // the deadline itself is still in time
    }
  }
  return at;
}

std::vector<TxQueue::Ended> TxQueue::take_ended() { return std::exchange(ended_, {}); }

std::size_t TxQueue::queued() const {
  std::size_t count = 0;
  for (const auto& lane : lanes_) count += lane.size();
  return count;
}

}  // namespace axisd::can
