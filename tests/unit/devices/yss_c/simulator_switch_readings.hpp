// What the tests of the simulator's switches share, and the readings, by subject.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>

#include "tests/unit/devices/yss_c/simulator_fixture.hpp"

namespace axisd::yss_c {

using Settings = simulation::SimulatedNodeSettings;

/// What can be seen from outside with a switch off, and on.
struct Reading {
  const char* name;
  std::int64_t (*probe)(Bench& bench);
  std::int64_t off, on;
  Settings settings{};
};

std::span<const Reading> motion_readings();
std::span<const Reading> homing_readings();
std::span<const Reading> object_readings();
std::span<const Reading> status_readings();
std::span<const Reading> terminal_readings();

inline const simulation::Mechanics home{.home_switch_from = 1000, .home_switch_to = 1200};

inline std::int64_t starts(Bench& bench) { return bench.drive().starts(); }
inline std::int64_t moving(Bench& bench) { return bench.drive().shaft_moving() ? 1 : 0; }
inline void run_velocity(Bench& bench, int rpm) {
  bench.enable(3);
  bench.write(0x60FF, 4, rpm);
  bench.run(500ms);
}
/// Homes with 24 or 29 by X0.
inline void home_with(Bench& bench, int method) {
  bench.assign(0, 1);
  bench.write(0x6098, 1, method);
  bench.enable(6);
  bench.control(0x1F);
}
inline std::int64_t homed(Bench& bench) {
  bench.run(20s);
  return bench.bit(8) ? 1 : 0;
}
inline std::int64_t after_power_cycle(Bench& bench, std::uint16_t index, std::uint8_t sub = 0) {
  bench.drive().set_power(false);
  bench.drive().set_power(true);
  bench.run(400ms);
  return bench.read(index, sub);
}
inline Settings with(simulation::Mechanics mechanics) { return {.mechanics = mechanics}; }

}  // namespace axisd::yss_c
