#include "devices/axis/settlement.hpp"

#include <algorithm>
#include <cstdlib>

namespace axisd {

namespace {

/// The counter has 32 bit and wraps.
std::int64_t between(std::int32_t a, std::int32_t b) {
  return std::abs(
      std::int64_t{static_cast<std::int32_t>(static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b))});
}

/// Homing ends at 0, or at its compensation: who began there may have been homed, or not.
Settlement settle_homing(std::int32_t start, std::int32_t compensation, std::int32_t counter,
                         std::int64_t window) {
  const auto near = std::max<std::int64_t>(window, 1);
  if (between(counter, start) > near) return Settlement::in_part;
  const bool began_at_an_end = between(start, 0) <= near || between(start, compensation) <= near;
  return began_at_an_end || between(counter, start) > window ? Settlement::unknown : Settlement::not_executed;
}

}  // namespace

Settlement settle(CommandKind kind, const SendingNote& note, std::int32_t counter, bool continuous,
                  std::int64_t window) {
  if (!note.start_pulses) return Settlement::unknown;
  // A restarted drive shows 0.
  if (!continuous && between(counter, 0) <= note.tolerance_pulses) return Settlement::unknown;
  if (kind == CommandKind::home)
    return settle_homing(*note.start_pulses, note.target_pulses.value_or(0), counter, window);
  const auto from_start = between(counter, *note.start_pulses);
  if (!note.target_pulses) {
    if (from_start <= window) return Settlement::not_executed;
    // It may have begun, and been stopped at once.
    return from_start <= note.tolerance_pulses ? Settlement::unknown : Settlement::in_part;
  }
  const bool at_target = between(counter, *note.target_pulses) <= note.tolerance_pulses;
  const bool nowhere_to_go = *note.target_pulses == *note.start_pulses;
  // What runs towards its bound is not done there: whoever asked for it wanted it to go on.
  const auto reached = kind == CommandKind::move_velocity ? Settlement::in_part : Settlement::done;
  if (at_target && (nowhere_to_go || from_start > note.tolerance_pulses)) return reached;
  if (at_target) return Settlement::unknown;  // it is at the start as well
  if (from_start <= window) return Settlement::not_executed;
  return from_start <= note.tolerance_pulses ? Settlement::unknown : Settlement::in_part;
}

}  // namespace axisd
