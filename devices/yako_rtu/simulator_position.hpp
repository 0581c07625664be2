// 0x000A and 0x000B of the simulated drive: the position in two words.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "buses/clock.hpp"
#include "devices/simulation/shaft.hpp"
#include "devices/yako_rtu/simulator_switches.hpp"

namespace axisd::yako_rtu {

class PositionWords {
 public:
  /// Both must outlive it.
  PositionWords(const Behaviour& behaviour, simulation::Shaft& shaft)
      : behaviour_(&behaviour), shaft_(&shaft) {}

  /// The supply is back: the counter begins at 0.
  void power_up();
  void clear();
  /// The upper word of `position`, for one reading.
  [[nodiscard]] std::uint16_t read_high(std::int32_t position, TimePoint now);

 private:
  const Behaviour* behaviour_;
  simulation::Shaft* shaft_;
  /// The upper word as it was read last, and when.
  std::optional<std::pair<std::uint16_t, TimePoint>> high_read_;
};

}  // namespace axisd::yako_rtu
