#include "buses/can/network.hpp"

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

void Network::transmit(Id participant, const Frame& frame) {
  assert(valid(frame));
  participants_.at(participant).queue.push_back(frame);
  arbitrate();
}

void Network::flush(Id participant) { participants_.at(participant).queue.clear(); }

std::size_t Network::waiting(Id participant) const {
  const auto found = participants_.find(participant);
  return found == participants_.end() ? 0 : found->second.queue.size();
}

void Network::set_stalled(bool stalled) {
  stalled_ = stalled;
  arbitrate();
}

Duration Network::frame_time(const Frame& frame) const { return worst_case_time(frame, bitrate_); }

void Network::arbitrate() {
  if (on_wire_ || stalled_) return;
  auto winner = participants_.end();
  for (auto each = participants_.begin(); each != participants_.end(); ++each) {
    if (each->second.queue.empty()) continue;
    if (winner == participants_.end() ||
        arbitration(each->second.queue.front()) < arbitration(winner->second.queue.front()))
      winner = each;
  }
  if (winner == participants_.end()) return;
  const auto frame = winner->second.queue.front();
  winner->second.queue.pop_front();
  on_wire_ = true;
  const auto fault = fault_ ? fault_(frame) : Fault{};
  busy_ = clock_->call_at(clock_->now() + frame_time(frame),
                          [this, sender = winner->first, frame, fault] { finish(sender, frame, fault); });
}

void Network::finish(Id sender, const Frame& frame, Fault fault) {
  ++frames_;
  on_wire_ = false;
  arbitrate();  // first, so that whatever the receivers send now has not begun before it
  const auto now = clock_->now();
  if (const auto found = participants_.find(sender); found != participants_.end()) {
    const auto receiver = found->second.receiver;  // it may leave
    receiver(frame, now, true);
  }
  if (fault.drop) return;
  if (fault.delay == Duration{}) return deliver(sender, frame, now);
  const auto key = ++last_delayed_;
  delayed_[key] = clock_->call_at(now + fault.delay, [this, key, sender, frame] {
    delayed_.erase(key);
    deliver(sender, frame, clock_->now());
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
  if (!open_) return;
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

void NetworkPort::cycle() {
  set_up(false);
  set_up(true);
}

PortCore::Written NetworkPort::write(const Frame& frame) {
  if (network_->waiting(id_) >= interface_queue) return Written::full;
  network_->transmit(id_, frame);
  return Written::taken;
}

}  // namespace axisd::can
