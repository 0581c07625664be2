#include "devices/simulation/rtu_network.hpp"

#include "devices/simulation/crc.hpp"

namespace axisd::simulation {

namespace {

const Fault* find(const std::vector<Fault>& faults, FaultKind kind) {
  const auto found = std::ranges::find(faults, kind, &Fault::kind);
  return found == faults.end() ? nullptr : &*found;
}

/// A reply that nobody asked for: node 247 answers a read with one register.
std::vector<std::uint8_t> default_foreign_frame() {
  std::vector<std::uint8_t> frame{0xF7, 0x03, 0x02, 0x12, 0x34};
  append_frame_crc(frame);
  return frame;
}

void append(ReplyPlan& plan, std::span<const std::uint8_t> bytes, TimePoint begin, Duration character,
            Duration gap) {
  auto at = begin;
  for (const auto byte : bytes) {
    at += character;
    plan.bytes.push_back(byte);
    plan.arrivals.push_back(at);
    at += gap;
  }
}

/// Two nodes with one address drive the line at once: a bit is 0 where either of them pulls it there. Never
/// quite at once, even if they say the same: the second is taken to be one bit late.
void collide(std::vector<std::uint8_t>& reply, std::span<const std::uint8_t> late) {
  reply.resize(std::max(reply.size(), late.size()), 0xFF);
  std::uint8_t idle = 1;
  for (std::size_t i = 0; i < late.size(); ++i) {
    reply[i] &= static_cast<std::uint8_t>(late[i] << 1U | idle);  // the lowest bit is the first on the wire
    idle = late[i] >> 7U;
  }
  if (frame_is_sound(reply)) reply.front() ^= 1U;
}

}  // namespace

RtuNetwork::RtuNetwork(RtuNetworkSettings settings) : settings_(settings) {}

void RtuNetwork::set_serial(const Serial& serial) {
  if (!serial_)
    for (const auto& node : nodes_) node->join(serial);
  serial_ = serial;
  settings_.baud = serial.baud;
  settings_.bits_per_character = serial.format.bits_per_character();
}

bool RtuNetwork::hears(const SimulatedRtuNode& node) const {
  const auto own = serial_ ? node.serial() : std::nullopt;
  return !own || own->fits(*serial_);
}

void RtuNetwork::remove(std::uint8_t address) {
  const auto* gone = node(address);
  if (gone == nullptr) return;
  std::erase_if(returns_, [&](const Return& each) { return each.node == gone; });
  std::erase_if(nodes_, [&](const auto& each) { return each.get() == gone; });
}

SimulatedRtuNode& RtuNetwork::add(std::unique_ptr<SimulatedRtuNode> node) {
  node->advance(now_);
  if (serial_) node->join(*serial_);
  return *nodes_.emplace_back(std::move(node));
}

SimulatedRtuNode* RtuNetwork::node(std::uint8_t address) const {
  for (const auto& node : nodes_)
    if (node->address() == address) return node.get();
  return nullptr;
}

Duration RtuNetwork::character_time() const {
  return Duration(1'000'000'000LL * settings_.bits_per_character / settings_.baud);
}

Duration RtuNetwork::silence() const {
  return settings_.baud > 19200 ? Duration(1'750'000) : character_time() * 7 / 2;
}

void RtuNetwork::pass_time(TimePoint now) {
  now = std::max(now, now_);
  std::ranges::sort(returns_, {}, &Return::when);
  while (!returns_.empty() && returns_.front().when <= now) {
    const auto [when, node] = returns_.front();
    returns_.erase(returns_.begin());
    node->advance(std::max(when, now_));
    node->set_power(true);
  }
  now_ = now;
  for (const auto& node : nodes_) node->advance(now);
}

std::optional<std::vector<std::uint8_t>> RtuNetwork::dispatch(std::span<const std::uint8_t> frame) {
  std::optional<std::vector<std::uint8_t>> reply;
  for (const auto& node : nodes_) {
    if (!hears(*node)) continue;
    const auto one = node->on_frame(frame);
    if (!one) continue;
    if (reply)
      collide(*reply, *one);
    else
      reply = one;
  }
  return reply;
}

void RtuNetwork::reboot(std::span<const std::uint8_t> request, Duration off_time) {
  for (const auto& node : nodes_) {
    if (node->address() != request[0]) continue;
    node->set_power(false);
    if (off_time > Duration::zero())
      returns_.push_back({now_ + off_time, node.get()});
    else
      node->set_power(true);
  }
}

std::optional<ReplyPlan> RtuNetwork::on_request(std::span<const std::uint8_t> frame, TimePoint request_end) {
  pass_time(request_end);
  if (observer_)
    observer_(request_end - character_time() * static_cast<std::int64_t>(frame.size()), true, frame);
  if (!connected_) return std::nullopt;
  const auto faults = frame_is_sound(frame) ? faults_.strike(frame) : std::vector<Fault>{};
  if (find(faults, FaultKind::hang_up) != nullptr) {
    hang_up_ = true;
    return std::nullopt;
  }
  if (const auto* fault = find(faults, FaultKind::reboot_before)) reboot(frame, fault->delay);
  std::vector<std::uint8_t> heard(frame.begin(), frame.end());
  if (find(faults, FaultKind::corrupt_request) != nullptr) heard.back() ^= 1U;  // of the CRC
  const bool passes = find(faults, FaultKind::drop_request) == nullptr;
  auto reply = passes ? dispatch(heard) : std::nullopt;
  if (passes && find(faults, FaultKind::duplicate_request) != nullptr) dispatch(heard);
  if (find(faults, FaultKind::drop_reply) != nullptr) reply.reset();
  if (const auto* fault = find(faults, FaultKind::reboot_after)) {
    reboot(frame, fault->delay);
    reply.reset();
  }
  return plan(frame, request_end, faults, std::move(reply));
}

std::optional<ReplyPlan> RtuNetwork::plan(std::span<const std::uint8_t> request, TimePoint request_end,
                                          const std::vector<Fault>& faults,
                                          std::optional<std::vector<std::uint8_t>> reply) {
  const auto character = character_time();
  ReplyPlan plan;
  if (find(faults, FaultKind::echo) != nullptr) append(plan, request, request_end, character, {});
  auto begin = request_end + turnaround();
  if (!plan.arrivals.empty()) begin = std::max(begin, plan.arrivals.back() + turnaround());
  if (const auto* fault = find(faults, FaultKind::foreign_frame)) {
    append(plan, fault->bytes.empty() ? default_foreign_frame() : fault->bytes, begin, character, {});
    begin = plan.arrivals.back() + silence();
  }
  if (reply && !reply->empty()) {
    if (const auto* fault = find(faults, FaultKind::delay_reply)) begin += fault->delay;
    if (find(faults, FaultKind::corrupt_reply) != nullptr) (*reply)[reply->size() / 2] ^= 0x10U;
    if (find(faults, FaultKind::truncate_reply) != nullptr) reply->pop_back();
    const auto* drip = find(faults, FaultKind::drip);
    append(plan, *reply, begin, character, drip == nullptr ? Duration{} : drip->delay);
    if (const auto* again = find(faults, FaultKind::duplicate_reply)) {
      append(plan, *reply, plan.arrivals.back() + again->delay, character, {});
      plan.repeated = reply->size();
    }
  }
  if (plan.bytes.empty()) return std::nullopt;
  plan.begin = plan.arrivals.front() - character;
  plan.end = plan.arrivals.back();
  if (observer_) observer_(plan.begin, false, plan.bytes);
  return plan;
}

void RtuNetwork::on_bytes(std::span<const std::uint8_t> bytes, TimePoint begin) {
  // Whatever was complete before these bytes is a frame of its own, even if nobody called advance()
  // meanwhile.
  if (!partial_.empty() && begin >= partial_end_ + silence()) advance(begin);
  begin = partial_.empty() ? begin : std::max(begin, partial_end_);
  partial_.insert(partial_.end(), bytes.begin(), bytes.end());
  partial_end_ = begin + character_time() * static_cast<std::int64_t>(bytes.size());
}

void RtuNetwork::advance(TimePoint now) {
  if (!partial_.empty() && now >= partial_end_ + silence()) {
    // The frame takes effect when the node has recognised its end; the reply counts from its last byte.
    pass_time(partial_end_ + silence());
    const auto frame = std::exchange(partial_, {});
    if (auto reply = on_request(frame, partial_end_)) replies_.push_back(std::move(*reply));
  }
  pass_time(now);
}

TimePoint RtuNetwork::next_event() const {
  auto next = partial_.empty() ? TimePoint::max() : partial_end_ + silence();
  for (const auto& one : returns_) next = std::min(next, one.when);
  return next;
}

std::optional<ReplyPlan> RtuNetwork::take_reply() {
  if (replies_.empty()) return std::nullopt;
  auto reply = std::move(replies_.front());
  replies_.pop_front();
  return reply;
}

}  // namespace axisd::simulation
