// How a value of another device lies in its registers. Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "buses/error.hpp"
#include "devices/generic/settings.hpp"

namespace axisd {

/// The scaled value of `raw`. Precondition: register_count(settings.type) registers.
double decode(const RegisterSettings& settings, std::span<const std::uint16_t> raw);

/// The registers that come nearest to `value`. Errors: out_of_range, with the permitted range.
Result<std::vector<std::uint16_t>> encode(const RegisterSettings& settings, double value);

/// Registers that are read together: neighbours without a gap, because an unknown address may be refused.
struct RegisterBlock {
  std::uint16_t address = 0;
  std::uint16_t count = 0;
  std::vector<std::size_t> values;  ///< indices of the settings that lie in it
};
/// As few blocks of at most 16 registers as possible; no value is torn.
std::vector<RegisterBlock> blocks_of(std::span<const RegisterSettings> registers);

}  // namespace axisd
