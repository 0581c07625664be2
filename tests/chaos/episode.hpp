#pragma once

#include <cstdint>

#include "tests/chaos/plant.hpp"

namespace axisd::chaos {

/// Of one seed or several.
struct Outcome {
  std::uint64_t transactions = 0, faulted = 0;          ///< on lines
  std::uint64_t can_transactions = 0, can_faulted = 0;  ///< on CAN
  int commands = 0, done = 0, not_executed = 0, starts = 0, stops = 0, positions = 0, marks = 0;
  int departures = 0, distances = 0, by_terminal = 0, by_sync = 0;
  int violations = 0;
  void add(const Outcome& other);
};

/// Half a minute of several clients on a plant with faults, then the faults end and everything is stopped. On
/// a full line all axes index, and a client does whatever it likes beside that. Fails the test for each
/// violation, and says how to repeat it.
Outcome run_episode(PlantKind kind, std::uint64_t seed);
/// Episodes of consecutive seeds until a fault has struck `faulted` transactions (with a network: of those on
/// CAN), or one is violated.
Outcome run_episodes(PlantKind kind, std::uint64_t first_seed, std::uint64_t faulted);

}  // namespace axisd::chaos
