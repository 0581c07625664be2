#include "buses/canopen/nmt.hpp"

#include <fmt/format.h>

#include <array>

#include "buses/canopen/cob.hpp"

namespace axisd::canopen {

std::string_view to_string(NmtCommand command) {
  switch (command) {
    case NmtCommand::start:
      return "start";
    case NmtCommand::stop:
      return "stop";
    case NmtCommand::enter_pre_operational:
      return "enter pre-operational";
    case NmtCommand::reset_node:
      return "reset node";
    case NmtCommand::reset_communication:
      return "reset communication";
  }
  return "?";
}

std::string_view to_string(NmtState state) {
  switch (state) {
    case NmtState::stopped:
      return "stopped";
    case NmtState::operational:
      return "operational";
    case NmtState::pre_operational:
      return "pre-operational";
    case NmtState::unknown:
      break;
  }
  return "unknown";
}

Result<can::Frame> nmt_frame(NmtCommand command, std::uint8_t node) {
  if (!valid_node(node))
    return fail(Reason::invalid_argument, fmt::format("NMT '{}' to node-ID {}", to_string(command), node),
                "name one node, 1 to 127: other masters may own the rest of the network");
  return can::make_frame(nmt_id, std::array{static_cast<std::uint8_t>(command), node});
}

std::optional<Heartbeat> parse_heartbeat(const can::Frame& frame) {
  constexpr unsigned toggle_bit = 0x80;
  if (frame.rtr || frame.size != 1) return std::nullopt;
  switch (frame.data[0] & ~toggle_bit) {
    case 0x00:
      return Heartbeat{.boot_up = true, .state = NmtState::pre_operational};
    case 0x04:
      return Heartbeat{.state = NmtState::stopped};
    case 0x05:
      return Heartbeat{.state = NmtState::operational};
    case 0x7F:
      return Heartbeat{.state = NmtState::pre_operational};
    default:
      return std::nullopt;
  }
}

void NmtMonitor::watch(std::uint8_t node, Duration timeout) {
  auto& slot = nodes_[node];
  if (!slot) slot = std::make_unique<Node>();
  slot->timeout = timeout;
  arm(node, *slot);
}

void NmtMonitor::expect_boot(std::uint8_t node, bool expected) {
  if (const auto found = nodes_.find(node); found != nodes_.end()) found->second->boot_expected = expected;
}

void NmtMonitor::on_heartbeat(std::uint8_t node, const Heartbeat& heartbeat, TimePoint at) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  auto& known = *found->second;
  auto& status = known.status;
  NodeEvent event{.node = node, .from = status.state, .to = heartbeat.state, .at = at};
  const bool was_lost = std::exchange(status.heartbeat_lost, false);
  status.state = heartbeat.state;
  status.last_heard = at;
  if (heartbeat.boot_up) {
    ++status.boots;
    // Its heartbeat time is what its memory says now, perhaps none: awaited from the first one again.
    status.heartbeats = 0;
    event.requested = std::exchange(known.boot_expected, false);
    event.kind = NodeEvent::Kind::booted;
  } else {
    ++status.heartbeats;
    event.kind = was_lost ? NodeEvent::Kind::heartbeat_again : NodeEvent::Kind::state_changed;
  }
  arm(node, known);
  if (heartbeat.boot_up || was_lost || event.from != event.to) handler_(event);
}

void NmtMonitor::arm(std::uint8_t id, Node& node) {
  if (node.timeout <= Duration::zero() || node.status.heartbeats == 0 || node.status.heartbeat_lost) {
    node.timer.reset();
    return;
  }
  node.timer =
      clock_->call_at(*node.status.last_heard + node.timeout, [this, id, &node] { on_timer(id, node); });
}

void NmtMonitor::on_timer(std::uint8_t id, Node& node) {
  node.status.heartbeat_lost = true;
  const auto from = std::exchange(node.status.state, NmtState::unknown);
  handler_({.kind = NodeEvent::Kind::heartbeat_lost, .node = id, .from = from, .at = clock_->now()});
}

void NmtMonitor::forget_states() {
  for (auto& [id, node] : nodes_) {
    node->timer.reset();
    node->status.state = NmtState::unknown;
    node->status.heartbeats = 0;
    node->status.heartbeat_lost = false;
  }
}

NmtMonitor::NodeStatus NmtMonitor::status(std::uint8_t node) const {
  const auto found = nodes_.find(node);
  return found == nodes_.end() ? NodeStatus{} : found->second->status;
}

}  // namespace axisd::canopen
