// Which block reads fetch a set of registers. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "devices/descriptor.hpp"

namespace axisd::yako_rtu {

struct RegisterBlock {
  std::uint16_t address = 0, count = 0;
  bool operator==(const RegisterBlock&) const = default;
};

/// At most 16 registers each (6.2.1), never across one that is not `readable` (a hole, a trigger); registers
/// nobody asked for may lie in between. `addresses` in any order; unreadable ones are left out.
std::vector<RegisterBlock> blocks_of(std::vector<std::uint16_t> addresses,
                                     const std::function<bool(std::uint32_t)>& readable);
/// The word of a register as the number that it means.
std::int64_t number_of(const ParameterSpec& parameter, std::uint16_t word);

}  // namespace axisd::yako_rtu
