#include "buses/canopen/emcy.hpp"

#include <algorithm>

#include "buses/canopen/object.hpp"

namespace axisd::canopen {

std::optional<Emergency> parse_emergency(std::uint8_t node, const can::Frame& frame, TimePoint at) {
  if (frame.rtr || frame.size != frame.data.size()) return std::nullopt;
  Emergency emergency{.node = node,
                      .code = static_cast<std::uint16_t>(number_of(std::span(frame.data).first(2))),
                      .error_register = frame.data[2],
                      .at = at};
  std::copy(frame.data.begin() + 3, frame.data.end(), emergency.vendor.begin());
  return emergency;
}

std::string_view emergency_text(std::uint16_t code) {
  switch (code >> 8U) {
    case 0x00:
      return "error reset or no error";
    case 0x10:
      return "generic error";
    case 0x80:
      return "monitoring";
    case 0x81:
      return "communication";
    case 0x82:
      return "protocol error";
    case 0x90:
      return "external error";
    case 0xF0:
      return "additional functions";
    case 0xFF:
      return "device specific";
    default:
      break;
  }
  switch (code >> 12U) {
    case 0x2:
      return "current";
    case 0x3:
      return "voltage";
    case 0x4:
      return "temperature";
    case 0x5:
      return "device hardware";
    case 0x6:
      return "device software";
    case 0x7:
      return "additional modules";
    default:
      return "unknown error code";
  }
}

void EmergencyHistory::add(const Emergency& emergency) {
  auto& node = nodes_[emergency.node];
  ++node.total;
  node.history.push_back(emergency);
  while (node.history.size() > capacity_) node.history.pop_front();
  if (!emergency.is_reset())
    node.active = emergency;
  else if (emergency.error_register == 0)
    node.active.reset();
}

const EmergencyHistory::Node* EmergencyHistory::find(std::uint8_t node) const {
  const auto found = nodes_.find(node);
  return found == nodes_.end() ? nullptr : &found->second;
}

const std::deque<Emergency>& EmergencyHistory::of(std::uint8_t node) const {
  static const std::deque<Emergency> none;
  const auto* found = find(node);
  return found == nullptr ? none : found->history;
}

std::optional<Emergency> EmergencyHistory::active(std::uint8_t node) const {
  const auto* found = find(node);
  return found == nullptr ? std::nullopt : found->active;
}

std::uint64_t EmergencyHistory::total(std::uint8_t node) const {
  const auto* found = find(node);
  return found == nullptr ? 0 : found->total;
}

void EmergencyHistory::on_boot(std::uint8_t node) {
  if (const auto found = nodes_.find(node); found != nodes_.end()) found->second.active.reset();
}

}  // namespace axisd::canopen
