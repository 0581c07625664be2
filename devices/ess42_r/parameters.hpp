#pragma once

#include <span>

#include "devices/descriptor.hpp"

namespace axisd::ess42_r {

/// The whole catalogue of manual 6.1, in order of address: 171 registers.
std::span<const ParameterSpec> parameters();

}  // namespace axisd::ess42_r
