#include "buses/modbus_rtu/punctual_wait.hpp"

#include <utility>

namespace axisd::modbus_rtu {

void PunctualWait::begin(TimePoint when) {
  when_ = when;
  asked_.reset();
  const auto asked = latency_.asked_for(when);
  if (monotonic_now() >= asked) return;
  block_until(asked);
  asked_ = asked;
}

/// Learns from a sleep how long waking took. The time.
TimePoint PunctualWait::woken() {
  const auto now = monotonic_now();
  if (asked_) latency_.note(*std::exchange(asked_, std::nullopt), now);
  return now;
}

}  // namespace axisd::modbus_rtu
