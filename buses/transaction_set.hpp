// What a drive asks of its bus, as data: a model's descriptor has one, the bus budget reads it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "buses/clock.hpp"

namespace axisd {

/// One exchange on an RS-485 line, in characters, with address and CRC.
struct ExchangeSize {
  std::uint16_t request = 8, reply = 8;
  bool operator==(const ExchangeSize&) const = default;
};
/// FC03 and FC16 of so many registers.
constexpr ExchangeSize reading(std::uint16_t registers) {
  return {.request = 8, .reply = static_cast<std::uint16_t>(5 + 2 * registers)};
}
constexpr ExchangeSize writing(std::uint16_t registers) {
  return {.request = static_cast<std::uint16_t>(9 + 2 * registers), .reply = 8};
}

/// Of a drive on RS-485.
struct RtuTransactionSet {
  ExchangeSize state;                               ///< one reading of its state, idle or moving
  ExchangeSize continuity;                          ///< the canary, which is read at least every second
  std::span<const ExchangeSize> start;              ///< the longest chain that starts a motion
  std::span<const ExchangeSize> drift;              ///< what is read again now and then at rest, at most
  std::span<const ExchangeSize> drift_of_segments;  ///< likewise, if the configuration has segments
  ExchangeSize stop;                                ///< the one frame of a stop
  ExchangeSize longest;                             ///< of all that it is ever asked, parameters included
};

/// Of a drive on CANopen. Transfers are expedited SDO transfers.
struct CanTransactionSet {
  /// Data bytes of the TPDOs that together tell its state, from the first TPDO on. A drive has four by
  /// default; none: polled by SDO.
  std::array<std::uint8_t, 4> state_pdos{};
  /// Where no SYNC asks for them, at 1 Mbit/s: a TPDO comes at most, and at least, this often. On slower
  /// networks in proportion.
  Duration pdo_inhibit{}, pdo_event{};
  std::uint8_t state_transfers = 0;       ///< one reading of its state by SDO
  std::uint8_t continuity_transfers = 0;  ///< the canary
  std::uint8_t drift_transfers = 0;       ///< what is read again now and then at rest, at most
  std::uint8_t stop_transfers = 0;        ///< of a stop, until it is acknowledged
  [[nodiscard]] int state_pdo_count() const {
    return static_cast<int>(std::ranges::count_if(state_pdos, [](auto bytes) { return bytes != 0; }));
  }
};

}  // namespace axisd
