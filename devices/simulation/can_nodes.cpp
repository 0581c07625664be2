#include "devices/simulation/can_nodes.hpp"

#include <algorithm>
#include <array>

namespace axisd::simulation {

namespace {

constexpr std::uint32_t sdo_request = 0x600, sdo_reply = 0x580;
/// An answer that a fault makes comes as late as a node's own.
constexpr Duration fault_latency = std::chrono::microseconds(500);

can::Frame abort_frame(const can::Frame& request, std::uint32_t code) {
  std::array<std::uint8_t, 8> bytes{0x80, request.data[1], request.data[2], request.data[3]};
  for (unsigned i = 0; i < 4; ++i) bytes.at(4 + i) = static_cast<std::uint8_t>(code >> (8 * i));
  return can::make_frame(request.id - sdo_request + sdo_reply, bytes);
}

can::Frame emergency_frame(const SimulatedCanNode& node, const Fault& fault) {
  const auto code = fault.code.value_or(0x1000);  // generic error
  std::array<std::uint8_t, 8> bytes{static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8U),
                                    0x01};
  std::copy_n(fault.bytes.begin(), std::min<std::size_t>(fault.bytes.size(), 6), bytes.begin() + 2);
  return can::make_frame(fault.cob.value_or(0x80U + node.address()), bytes);
}

}  // namespace

void CanNodes::set_bitrate(std::uint32_t bitrate) {
  if (!bitrate_)
    for (const auto& node : nodes_) node->join(bitrate);
  bitrate_ = bitrate;
}

void CanNodes::remove(std::uint8_t address) {
  const auto* gone = node(address);
  if (gone == nullptr) return;
  troubles_.erase(gone);
  std::erase_if(late_, [&](const auto& each) { return each.second.first == gone; });
  std::erase_if(nodes_, [&](const auto& each) { return each.get() == gone; });
  set_timer();
}

SimulatedCanNode& CanNodes::add(std::unique_ptr<SimulatedCanNode> node) {
  node->advance(now_);
  if (bitrate_) node->join(*bitrate_);
  auto& added = *nodes_.emplace_back(std::move(node));
  advance();
  return added;
}

SimulatedCanNode* CanNodes::node(std::uint8_t address) const {
  for (const auto& node : nodes_)
    if (node->address() == address) return node.get();
  return nullptr;
}

bool CanNodes::hears(const SimulatedCanNode& node) const {
  const auto own = bitrate_ ? node.bitrate() : std::nullopt;
  return connected_ && (!own || *own == *bitrate_) && !silent(node);
}

bool CanNodes::silent(const SimulatedCanNode& node) const {
  const auto found = troubles_.find(&node);
  return found != troubles_.end() && found->second.silent_until > now_;
}

void CanNodes::on_frame(const can::Frame& frame, TimePoint at) {
  run_until(std::max(at, now_));
  if (observer_) observer_(now_, true, frame);
  for (const auto& node : nodes_)
    if (hears(*node)) deliver(*node, frame);
  collect();
  set_timer();
}

/// `frame` came from the wire; faults may strike it.
void CanNodes::deliver(SimulatedCanNode& node, const can::Frame& frame) {
  auto striking = faults_.strike(node.address(), frame);
  const auto has = [&](FaultKind kind) {
    return std::ranges::find(striking, kind, &Fault::kind) != striking.end();
  };
  const bool is_sdo = frame.id == sdo_request + node.address() && frame.size == 8;
  for (const auto& fault : striking)
    if (fault.kind != FaultKind::reboot_after) strike(node, fault);
  if (has(FaultKind::drop_request) || silent(node)) return;
  const auto aborts = std::ranges::find(striking, FaultKind::abort, &Fault::kind);
  if (is_sdo && aborts != striking.end()) {
    send_later(node, now_ + fault_latency, abort_frame(frame, aborts->code.value_or(0x08000000)));
    return;
  }
  if (auto& trap = trouble(node).trap; is_sdo && trap) {
    if (const auto answer = trap->on_request(frame)) {
      send_later(node, now_ + fault_latency, *answer);
      return;
    }
    trap.reset();
  }
  hand_over(node, frame);
  for (const auto& fault : striking)
    if (fault.kind == FaultKind::reboot_after) strike(node, fault);
}

void CanNodes::hand_over(SimulatedCanNode& node, const can::Frame& frame) {
  if (!node.hears(frame)) return;
  node.advance(now_);
  node.on_frame(frame);
}

void CanNodes::strike(SimulatedCanNode& node, const Fault& fault) {
  auto& one = trouble(node);
  switch (fault.kind) {
    case FaultKind::drop_reply:
      ++one.lost_replies;
      break;
    case FaultKind::delay_reply:
      one.late_replies.push_back(fault.delay);
      break;
    case FaultKind::silence:
      one.silent_until = fault.delay > Duration{} ? now_ + fault.delay : TimePoint::max();
      break;
    case FaultKind::flood:
      one.flood = fault;
      one.flood_until = fault.delay > Duration{} ? now_ + fault.delay : TimePoint::max();
      one.flood_next = now_;
      break;
    case FaultKind::emcy:
      emit(node, emergency_frame(node, fault));
      break;
    case FaultKind::wrong_toggle:
    case FaultKind::endless_upload:
      one.trap.emplace(node.address(), fault.kind == FaultKind::wrong_toggle);
      break;
    case FaultKind::reboot:
    case FaultKind::reboot_before:
    case FaultKind::reboot_after:
      reboot(node, fault.delay);
      break;
    default:
      break;
  }
}

void CanNodes::reboot(SimulatedCanNode& node, Duration off_time) {
  node.advance(now_);
  node.set_power(false);
  std::erase_if(late_, [&node](const auto& late) { return late.second.first == &node; });
  if (off_time > Duration{})
    trouble(node).returns = now_ + off_time;
  else
    node.set_power(true);
}

void CanNodes::add_fault(const Fault& fault) {
  run_until(std::max(clock_->now(), now_));
  if (!fault.strikes_at_once()) {
    faults_.add(fault);
  } else {
    for (const auto& node : nodes_)
      if (!fault.node || *fault.node == node->address()) strike(*node, fault);
  }
  collect();
  set_timer();
}

void CanNodes::clear_faults() {
  faults_.clear();
  for (auto& [node, one] : troubles_) one = Trouble{.returns = one.returns};
  advance();
}

void CanNodes::pass_time(TimePoint now) {
  run_until(std::max(now, now_));
  for (const auto& node : nodes_) node->advance(now_);
  collect();
  set_timer();
}

/// Event by event, so that what one node sends reaches the others when it happens.
void CanNodes::run_until(TimePoint now) {
  for (auto next = next_event(); next <= now; next = next_event()) {
    now_ = std::max(now_, next);
    for (const auto& node : nodes_)
      if (node->next_event() <= now_) node->advance(now_);
    for (auto& [node, one] : troubles_) {
      if (one.returns > now_) continue;
      one.returns = TimePoint::max();
      const auto found = std::ranges::find(nodes_, node, &std::unique_ptr<SimulatedCanNode>::get);
      (*found)->advance(now_);
      (*found)->set_power(true);
    }
    for (auto& [node, one] : troubles_)
      if (one.flood_next <= now_) flood(*node, one);
    while (!late_.empty() && late_.begin()->first <= now_) {
      const auto [node, frame] = late_.begin()->second;
      late_.erase(late_.begin());
      emit(*node, frame);
    }
    collect();
  }
  now_ = now;
}

/// Back to back, as fast as the bit rate lets frames of 8 bytes follow each other.
void CanNodes::flood(const SimulatedCanNode& node, Trouble& trouble) {
  if (now_ >= trouble.flood_until) {
    trouble.flood_next = TimePoint::max();
    return;
  }
  const auto frame =
      can::make_frame(trouble.flood.cob.value_or(0x180U + node.address()),
                      std::array<std::uint8_t, 8>{0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55});
  emit(node, frame);
  trouble.flood_next = now_ + Duration(can::worst_case_bits(frame) * std::int64_t{1'000'000'000} /
                                       bitrate_.value_or(1'000'000));
}

/// What nodes want to send, until none does.
void CanNodes::collect() {
  for (bool any = true; any;) {
    any = false;
    for (const auto& node : nodes_) {
      while (const auto frame = node->take_frame()) {
        any = true;
        from_node(*node, *frame);
      }
    }
  }
}

void CanNodes::from_node(SimulatedCanNode& node, const can::Frame& frame) {
  auto& one = trouble(node);
  if (frame.id == sdo_reply + node.address()) {
    if (one.lost_replies > 0) {
      --one.lost_replies;
      return;
    }
    if (!one.late_replies.empty()) {
      send_later(node, now_ + one.late_replies.front(), frame);
      one.late_replies.erase(one.late_replies.begin());
      return;
    }
    const auto of_node = [&node](const auto& late) { return late.second.first == &node; };
    if (std::ranges::any_of(late_, of_node)) return send_later(node, now_, frame);
  }
  emit(node, frame);
}

/// Frames with one identifier keep their order on the wire: what is late holds up what comes after it.
void CanNodes::send_later(const SimulatedCanNode& node, TimePoint when, const can::Frame& frame) {
  for (const auto& [late, entry] : late_)
    if (entry.first == &node) when = std::max(when, late);
  late_.emplace(when, std::pair{&node, frame});
}

/// Onto the wire, and to the other nodes.
void CanNodes::emit(const SimulatedCanNode& node, const can::Frame& frame) {
  if (!hears(node)) return;  // silent, cut off, or at another bit rate
  if (observer_) observer_(now_, false, frame);
  send_(frame);
  for (const auto& other : nodes_)
    if (other.get() != &node && hears(*other)) hand_over(*other, frame);
}

TimePoint CanNodes::next_event() const {
  auto next = late_.empty() ? TimePoint::max() : late_.begin()->first;
  for (const auto& node : nodes_) next = std::min(next, node->next_event());
  for (const auto& [node, one] : troubles_) next = std::min({next, one.returns, one.flood_next});
  return next;
}

void CanNodes::set_timer() {
  timer_.reset();
  const auto next = next_event();
  if (next != TimePoint::max()) timer_ = clock_->call_at(next, [this, next] { pass_time(next); });
}

NetworkNodes::NetworkNodes(Clock& clock, can::Network& network)
    : network_(&network),
      nodes_(clock,
             [this](const can::Frame& frame) {
               waiting_.emplace(frame.id, frame);
               transmit();
             }),
      id_(network.join([this](const can::Frame& frame, TimePoint at, bool own) {
        if (!own) {
          nodes_.on_frame(frame, at);
          return;
        }
        on_wire_ = false;
        transmit();
      })) {
  nodes_.set_bitrate(network.bitrate());
}

void NetworkNodes::transmit() {
  if (on_wire_ || waiting_.empty()) return;
  const auto frame = waiting_.begin()->second;
  waiting_.erase(waiting_.begin());
  on_wire_ = true;
  network_->transmit(id_, frame, nodes_.now());
}

}  // namespace axisd::simulation
