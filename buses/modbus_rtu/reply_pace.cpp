#include "buses/modbus_rtu/reply_pace.hpp"

#include <algorithm>
#include <utility>

namespace axisd::modbus_rtu {

Duration ReplyPace::quiet(std::uint8_t node, Duration on_wire) const {
  const auto& pace = nodes_.at(node);
  if (pace.to_measure > 0) return Duration::zero();
  return std::max(pace.soonest + on_wire + (pace.unchecked == 0 ? -margin : Duration::zero()),
                  Duration::zero());
}

void ReplyPace::complete(std::uint8_t node, Duration on_wire, Duration took, bool awaited) {
  auto& pace = nodes_.at(node);
  const bool slept = pace.to_measure == 0;
  const bool checked = slept && pace.unchecked == 0;
  if (slept) pace.unchecked = (pace.unchecked + 1) % check_every;
  if (slept && !checked && !awaited) return;  // as it was expected
  // One that lay ready came sooner: nobody knows by how much.
  const auto turnaround = awaited ? took - on_wire : pace.soonest - margin;
  pace.to_measure = awaited ? std::max(pace.to_measure - 1, 0) : measured;
  if (pace.to_measure > 0) pace.unchecked = 0;
  pace.soonest = std::min(pace.soonest, turnaround);
  pace.soonest_lately = std::min(pace.soonest_lately, turnaround);
  if (++pace.lately < remembered) return;
  pace.soonest = std::exchange(pace.soonest_lately, Duration::max());
  pace.lately = 0;
}

}  // namespace axisd::modbus_rtu
