// Exact targets (M19). Apart from scale.hpp because the rational type is slow to compile.
#pragma once

#include <cstdint>
#include <optional>

#include "devices/units/exact.hpp"
#include "devices/units/scale.hpp"

namespace axisd {

/// The number that a double stands for, without rounding; nullopt for NaN and infinity.
std::optional<Exact> to_exact(double value);
/// User units of a (drive direction) pulse count, without rounding.
Exact to_exact_units(const Scale& scale, std::int64_t pulses);
/// Nearest pulse count, rounded once, half away from zero; nullopt if it does not fit into 64 bit.
std::optional<std::int64_t> to_pulses(const Scale& scale, const Exact& units);

}  // namespace axisd
