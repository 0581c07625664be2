// What the family's driver asks of its line, as data for the bus budget.
#pragma once

#include <array>

#include "buses/transaction_set.hpp"

namespace axisd::yako_rtu {

/// Most registers in one read or write (6.2).
inline constexpr std::uint16_t longest_block = 16;
/// Canary, what homing compares (longer than what a move writes), its block, trigger.
inline constexpr std::array<ExchangeSize, 4> start_chain = {reading(6), reading(6), writing(6),
                                                            ExchangeSize{}};
/// Current to 0x0018; levels and functions of inputs, then of outputs.
inline constexpr std::array<ExchangeSize, 4> watched_blocks = {
    reading(longest_block), reading(longest_block), reading(longest_block), reading(longest_block)};
/// Five tables of a row per segment, and 0x0026.
inline constexpr std::array<ExchangeSize, 6> watched_segments = {
    reading(longest_block), reading(longest_block), reading(longest_block),
    reading(longest_block), reading(longest_block), reading(1)};

inline constexpr RtuTransactionSet transactions = {.state = reading(10),
                                                   .continuity = reading(6),
                                                   .start = start_chain,
                                                   .drift = watched_blocks,
                                                   .drift_of_segments = watched_segments,
                                                   .stop = {},
                                                   .longest = writing(longest_block)};

}  // namespace axisd::yako_rtu
