#include "buses/can/network.hpp"

#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

namespace axisd::can {
namespace {

/// The bits that decide the arbitration, the dominant first: a base id wins over an extended one that begins
/// with it, and data wins over a remote request.
std::uint64_t arbitration(const Frame& frame) {
  const std::uint64_t rtr = frame.rtr ? 1 : 0;
  if (!frame.extended) return std::uint64_t{frame.id} << 21U | rtr << 20U;
  const std::uint64_t base = frame.id >> 18U;
  return base << 21U | std::uint64_t{3} << 19U | std::uint64_t{frame.id & 0x3FFFFU} << 1U | rtr;
}

}  // namespace

Network::Id Network::join(Receiver receiver) {
  participants_.emplace(++last_id_, Participant{.receiver = std::move(receiver), .queue = {}});
  return last_id_;
}

void Network::leave(Id participant) { participants_.erase(participant); }

void Network::transmit(Id participant, const Frame& frame, TimePoint ready) {
  assert(valid(frame));
  participants_.at(participant).queue.push_back({.frame = frame, .ready = ready});
  arbitrate(std::min(ready, clock_->now()));
}

void Network::flush(Id participant) { participants_.at(participant).queue.clear(); }

std::size_t Network::waiting(Id participant) const {
  const auto found = participants_.find(participant);
  return found == participants_.end() ? 0 : found->second.queue.size();
}

void Network::set_stalled(bool stalled) {
  stalled_ = stalled;
  arbitrate(clock_->now());
}

void Network::catch_up(TimePoint now) {
  while (on_wire_ && on_wire_->ends <= now) finish();
}

Duration Network::frame_time(const Frame& frame) const { return worst_case_time(frame, bitrate_); }

/// Of the frames that are ready at `at`, or when the wire is free.
void Network::arbitrate(TimePoint at) {
  if (on_wire_ || stalled_) return;
  const auto begins = std::max(at, free_since_);
  auto first_ready = TimePoint::max();
  auto winner = participants_.end();
  for (auto each = participants_.begin(); each != participants_.end(); ++each) {
    if (each->second.queue.empty()) continue;
    const auto& head = each->second.queue.front();
    first_ready = std::min(first_ready, head.ready);
    if (head.ready > begins) continue;
    if (winner == participants_.end() ||
        arbitration(head.frame) < arbitration(winner->second.queue.front().frame))
      winner = each;
  }
  next_.reset();
  if (winner == participants_.end()) {
    if (first_ready != TimePoint::max())
      next_ = clock_->call_at(first_ready, [this, first_ready] { arbitrate(first_ready); });
    return;
  }
  const auto frame = winner->second.queue.front().frame;
  winner->second.queue.pop_front();
  on_wire_ = {.sender = winner->first,
              .frame = frame,
              .fault = fault_ ? fault_(frame) : Fault{},
              .ends = begins + frame_time(frame)};
  next_ = clock_->call_at(on_wire_->ends, [this] { finish(); });
}

void Network::finish() {
  const auto ended = *on_wire_;
  const auto sender = ended.sender;
  const auto& frame = ended.frame;
  const auto at = ended.ends;
  on_wire_.reset();
  free_since_ = at;
  ++frames_;
  arbitrate(at);  // first, so that whatever the receivers send now has not begun before it
  if (const auto found = participants_.find(sender);
      found != participants_.end() && !ended.fault.unconfirmed) {
    const auto receiver = found->second.receiver;  // it may leave
    receiver(frame, at, true);
  }
  if (ended.fault.drop) return;
  if (ended.fault.delay == Duration{}) return deliver(sender, frame, at);
  const auto key = ++last_delayed_;
  const auto when = at + ended.fault.delay;
  delayed_[key] = clock_->call_at(when, [this, key, when, sender, frame] {
    delayed_.erase(key);
    deliver(sender, frame, when);
  });
}

void Network::deliver(Id sender, const Frame& frame, TimePoint at) {
  std::vector<Id> others;
  for (const auto& [id, participant] : participants_)
    if (id != sender) others.push_back(id);
  for (const auto id : others) {
    const auto found = participants_.find(id);  // another's reaction may have been to leave
    if (found == participants_.end()) continue;
    const auto receiver = found->second.receiver;
    receiver(frame, at, false);
  }
}

NetworkPort::NetworkPort(Clock& clock, PortSettings settings, Network& network)
    : PortCore(clock, std::move(settings)), network_(&network) {}

void NetworkPort::open() {
  open_ = true;
  if (present_) set_up(wanted_up_);
}

void NetworkPort::shut() {
  open_ = false;
  leave();
}

void NetworkPort::leave() {
  if (const auto id = std::exchange(id_, 0); id != 0) network_->leave(id);
}

void NetworkPort::set_up(bool up) {
  present_ = true;
  wanted_up_ = up;
  const auto link = tracker().state().link;
  const bool is_up = link != InterfaceState::down && link != InterfaceState::removed;
  if (!open_ || (up && is_up)) return;
  leave();
  if (up) {
    id_ = network_->join([this](const Frame& frame, TimePoint at, bool own) {
      if (own)
        own_frame_seen(frame, at, clock().now(), true);
      else
        frame_received(frame, at);
      settle_later();
    });
    ++counts().openings;
    tracker().up();
  } else {
    tracker().down();
  }
  link_changed();
  settle_later();
}

void NetworkPort::remove() {
  present_ = false;
  if (!open_) return;
  leave();
  tracker().removed();
  link_changed();
  settle_later();
}

void NetworkPort::report(Controller controller) {
  if (id_ == 0) return;
  ++counts().error_frames;
  if (controller == Controller::bus_off) leave();
  tracker().controller(controller);
  link_changed();
  settle_later();
}

bool NetworkPort::cycle() {
  set_up(false);
  set_up(true);
  return true;
}

PortCore::Written NetworkPort::write(const Frame& frame) {
  if (network_->waiting(id_) >= interface_queue) return Written::full;
  network_->transmit(id_, frame);
  return Written::taken;
}

}  // namespace axisd::can
