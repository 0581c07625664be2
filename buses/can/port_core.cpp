#include "buses/can/port_core.hpp"

#include <algorithm>
#include <utility>

namespace axisd::can {
namespace {

bool same(const PortState& a, const PortState& b) {
  return a.link == b.link && a.error.has_value() == b.error.has_value() &&
         (!a.error || a.error->message == b.error->message);
}

}  // namespace

PortCore::PortCore(Clock& clock, PortSettings settings)
    : clock_(&clock),
      settings_(std::move(settings)),
      queue_(settings_),
      tracker_(settings_.bus, settings_.interface) {}

void PortCore::start(PortHandlers handlers) {
  handlers_ = std::move(handlers);
  open();
  settle_later();
}

void PortCore::send(const Frame& frame, const SendOptions& options, Completion completion) {
  queue_.push(frame, options, std::move(completion));
  pump();
  settle_later();
}

void PortCore::purge_superseded(const AxisGate& gate) {
  queue_.purge_superseded(gate, clock_->now());
  settle_later();
}

void PortCore::close() {
  if (std::exchange(closed_, true)) return;
  shut();
  tracker_.down();
  queue_.end_all();
  tell();
  timer_.reset();
}

void PortCore::frame_received(const Frame& frame, TimePoint at) {
  ++counters_.received;
  events_.emplace_back(ReceivedFrame{.frame = frame, .at = at});
}

void PortCore::own_frame_seen(const Frame& frame, TimePoint at, TimePoint now, bool proof) {
  queue_.echo(frame, at, now, proof);
}

bool PortCore::may_gather() const {
  return queue_.unconfirmed() == 0 && queue_.queued() == 0 && handlers_.may_gather && handlers_.may_gather();
}

void PortCore::link_changed() {
  const auto& state = tracker_.state();
  if (known_ && same(state, *known_)) return;
  const bool other_link = !known_ || state.link != known_->link;
  if (other_link && state.link == InterfaceState::bus_off) ++counters_.bus_offs;
  if (other_link && state.link == InterfaceState::stalled) ++counters_.stalls;
  if (!state.can_send()) queue_.end_all();
  collect();
  known_ = state;
  events_.emplace_back(state);
}

void PortCore::pump() {
  if (!tracker_.state().can_send()) return queue_.end_all();
  if (queue_.queued() == 0) return;  // mostly so, and each look at the clock costs
  const auto now = clock_->now();
  while (const auto* frame = queue_.next(now)) {
    switch (write(*frame)) {
      case Written::taken:
        queue_.handed_over(now);
        continue;
      case Written::full:
        ++counters_.no_buffer;
        queue_.no_buffer(now);
        continue;
      case Written::lost:
        return link_changed();
    }
  }
}

void PortCore::settle() {
  if (!closed_ && queue_.awaits_drain() && drained()) queue_.drained(clock_->now());
  pump();
  tell();
  settle_later();
}

void PortCore::collect() {
  for (auto& ended : queue_.take_ended()) events_.emplace_back(std::move(ended));
}

/// One by one from the member: whoever is told may call send() or close().
void PortCore::tell() {
  for (collect(); !events_.empty(); collect()) {
    auto event = std::move(events_.front());
    events_.pop_front();
    if (auto* ended = std::get_if<TxQueue::Ended>(&event)) {
      const auto status = ended->result.status;
      ++(status == SendStatus::sent      ? counters_.sent
         : status == SendStatus::unknown ? counters_.unknown
                                         : counters_.not_sent);
      if (ended->completion) ended->completion(ended->result);
    } else if (const auto* received = std::get_if<ReceivedFrame>(&event)) {
      if (!closed_ && handlers_.on_frame) handlers_.on_frame(*received);
    } else if (!closed_ && handlers_.on_state) {
      handlers_.on_state(std::get<PortState>(event));
    }
  }
}

void PortCore::settle_later() {
  collect();
  const auto at = events_.empty() ? queue_.next_event() : clock_->now();
  if (at == TimePoint::max())
    timer_.reset();
  else
    timer_ = clock_->call_at(at, [this] { on_timer(); });
}

void PortCore::on_timer() {
  const auto now = clock_->now();  // before what has happened by then is read: the host may be held up here
  if (tracker_.state().can_send()) catch_up();
  if (queue_.awaits_drain() && drained()) queue_.drained(clock_->now());
  if (queue_.overdue(now) && empty_below()) queue_.give_up_overdue(now);
  queue_.reap(now);
  if (queue_.stalled(now)) {
    tracker_.stalled();
    link_changed();
  }
  settle();
}

}  // namespace axisd::can
