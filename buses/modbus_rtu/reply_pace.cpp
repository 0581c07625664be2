#include "buses/modbus_rtu/reply_pace.hpp"

#include <algorithm>
#include <utility>

namespace axisd::modbus_rtu {

Duration ReplyPace::quiet(std::uint8_t node, Duration on_wire) const {
  const auto& pace = nodes_.at(node);
  if (pace.to_measure > 0) return Duration::zero();
  const auto whole = pace.soonest + on_wire;
  return std::max(whole > long_wait ? whole - std::min(awake_after_long, on_wire) : whole + after_,
                  Duration::zero());
}

void ReplyPace::complete(std::uint8_t node, Duration on_wire, Duration took, Met met) {
  auto& pace = nodes_.at(node);
  const bool ready = met == Met::ready;
  if (met != Met::awake && pace.soonest + on_wire <= long_wait)
    after_ = std::clamp(after_ + (ready ? -sooner : later), earliest, latest);
  pace.to_measure = std::max(pace.to_measure - 1, 0);
  pace.ready_in_a_row = ready ? pace.ready_in_a_row + 1 : 0;
  if (pace.ready_in_a_row == suspicious) {
    pace.ready_in_a_row = 0;
    pace.to_measure = 1;
  }
  const auto began = took - on_wire;
  // One that lay ready may have come as soon as the soonest: else they would seem later and later.
  const bool soon = ready && began < pace.soonest + on_time;
  pace.soonest = std::min(pace.soonest, began);
  pace.soonest_lately = std::min(pace.soonest_lately, soon ? pace.soonest : began);
  if (++pace.lately < remembered) return;
  pace.soonest = std::exchange(pace.soonest_lately, Duration::max());
  pace.lately = 0;
}

}  // namespace axisd::modbus_rtu
