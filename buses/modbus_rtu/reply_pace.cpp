#include "buses/modbus_rtu/reply_pace.hpp"

#include <algorithm>
#include <utility>

namespace axisd::modbus_rtu {

Duration ReplyPace::quiet(std::uint8_t node, Duration on_wire) const {
  const auto& pace = nodes_.at(node);
  if (pace.to_measure > 0) return Duration::zero();
  return std::max(pace.soonest + on_wire - margin, Duration::zero());
}

void ReplyPace::complete(std::uint8_t node, Duration on_wire, Duration took, std::optional<Duration> slept) {
  auto& pace = nodes_.at(node);
  pace.to_measure = std::max(pace.to_measure - 1, 0);
  pace.prompt_in_a_row = slept && took - *slept < prompt ? pace.prompt_in_a_row + 1 : 0;
  if (pace.prompt_in_a_row == suspicious) {
    pace.prompt_in_a_row = 0;
    pace.to_measure = 1;
  }
  pace.soonest = std::min(pace.soonest, took - on_wire);
  pace.soonest_lately = std::min(pace.soonest_lately, took - on_wire);
  if (++pace.lately < remembered) return;
  pace.soonest = std::exchange(pace.soonest_lately, Duration::max());
  pace.lately = 0;
  pace.to_measure = 1;
}

}  // namespace axisd::modbus_rtu
