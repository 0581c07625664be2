// What a frame asks of a drive, read as the manuals define registers and objects.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "buses/can/port.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::chaos {

struct Telegram {
  enum class Start : std::uint8_t { none, motion, homing };
  /// What a control word that waits in the drive for the next SYNC is to do there.
  enum class Waiting : std::uint8_t { unchanged, start, nothing };
  Start start = Start::none;
  Waiting waiting = Waiting::unchanged;
  /// How far a start of a positioning motion takes the shaft, pulses: as the drive's own registers and its
  /// own counter have it. Nothing: no such start, or none with an end.
  std::optional<std::int64_t> way{};
  bool stop = false;
  bool energise = false;  ///< the power stage is to be switched on
  bool sync = false;
};

/// A request on an RS-485 line, with or without its checksum, as it concerns `drive`, which has not had it
/// yet.
Telegram read_request(std::span<const std::uint8_t> request, const simulation::SimulatedNode& drive);
/// A frame of the master's on a CAN network, likewise: what a control word does depends on what the drive is
/// doing.
Telegram read_frame(const can::Frame& frame, const simulation::SimulatedNode& drive);

}  // namespace axisd::chaos
