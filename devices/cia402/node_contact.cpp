#include "devices/cia402/node_contact.hpp"

#include <algorithm>

namespace axisd::cia402 {

void NodeContact::begin() { settled_ = rebooted_ = started_ = false; }

void NodeContact::booted(bool needed) {
  rebooted_ = rebooted_ || needed;
  heartbeat_lost_ = false;
  pending_alarm_ = 0;
}

Duration NodeContact::silent_for(TimePoint now, std::optional<TimePoint> heard) const {
  const auto since = silent_since_.value_or(now);
  return now - std::max(since, heard.value_or(since));
}

}  // namespace axisd::cia402
