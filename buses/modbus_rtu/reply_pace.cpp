#include "buses/modbus_rtu/reply_pace.hpp"

#include <algorithm>
#include <utility>

namespace axisd::modbus_rtu {

Duration ReplyPace::quiet(std::uint8_t node, Duration on_wire) const {
  const auto& pace = nodes_.at(node);
  return pace.to_measure > 0 ? Duration::zero() : std::max(pace.soonest + on_wire - margin, Duration::zero());
}

void ReplyPace::complete(std::uint8_t node, Duration on_wire, Duration took, bool awaited) {
  auto& pace = nodes_.at(node);
  // One that lay ready came sooner: nobody knows by how much.
  const auto turnaround = std::max(awaited ? took - on_wire : pace.soonest - margin, Duration::zero());
  pace.to_measure = awaited ? std::max(pace.to_measure - 1, 0) : measured;
  pace.soonest = std::min(pace.soonest, turnaround);
  pace.soonest_lately = std::min(pace.soonest_lately, turnaround);
  if (++pace.lately < remembered) return;
  pace.soonest = std::exchange(pace.soonest_lately, Duration::max());
  pace.lately = 0;
}

}  // namespace axisd::modbus_rtu
