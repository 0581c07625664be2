// How a value of another device lies in its registers or objects. Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "buses/error.hpp"
#include "devices/generic/settings.hpp"

namespace axisd {

/// The scaled value of `raw`, of which the lowest byte_count(settings.type) bytes count.
double decode(const ValueSettings& settings, std::uint32_t raw);
/// The raw number that comes nearest to `value`. Errors: out_of_range, with the permitted range.
Result<std::uint32_t> encode(const ValueSettings& settings, double value);

/// The number in one or two registers, high word first, and back. Precondition: register_count(type)
/// registers.
std::uint32_t from_registers(std::span<const std::uint16_t> registers);
std::vector<std::uint16_t> to_registers(std::uint32_t raw, ValueType type);

/// Registers that are read together: neighbours without a gap, because an unknown address may be refused.
struct RegisterBlock {
  std::uint16_t address = 0;
  std::uint16_t count = 0;
  std::vector<std::size_t> values;  ///< indices of the settings that lie in it
};
/// As few blocks of at most 16 registers as possible; no value is torn.
std::vector<RegisterBlock> blocks_of(std::span<const ValueSettings> values);

}  // namespace axisd
