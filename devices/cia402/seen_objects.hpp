// What a drive was seen to be, object by object, where its model or manual leaves it open.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>

#include "buses/canopen/object.hpp"
#include "buses/clock.hpp"

namespace axisd::cia402 {

/// Thread: core.
struct SeenObjects {
  std::map<std::uint32_t, std::uint8_t> sizes;  ///< in bytes, as it takes or reports them
  Duration answer_time{};                       ///< of its SDO server, the longest of late
  bool other_homing_codes = false;              ///< it refused the first of HomingCode, and took the other
  /// VendorObjects::position_window and velocity_threshold, as they were read last.
  std::optional<std::int64_t> position_window, velocity_threshold;
  // Of this power cycle.
  std::optional<bool> closed_loop;  ///< the loop mode, before the first write
  /// 6085h, as it was read last; nothing: a quick stop brakes as a stop, as far as is known.
  std::optional<std::int64_t> quick_stop_ramp;
  bool halts_on_ramp_alone = false;  ///< it refused another 605Dh

  void forget_power_cycle() {
    closed_loop.reset();
    quick_stop_ramp.reset();
    halts_on_ramp_alone = false;
  }
  /// An answer took so long.
  void note_answer(Duration took) { answer_time = std::max(took, answer_time * 7 / 8); }
  /// Nothing: not seen.
  [[nodiscard]] std::optional<std::uint8_t> size(canopen::Object object) const {
    const auto known = sizes.find(object.key());
    return known == sizes.end() ? std::nullopt : std::optional(known->second);
  }
};

}  // namespace axisd::cia402
