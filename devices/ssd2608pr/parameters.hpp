#pragma once

#include <span>

#include "devices/descriptor.hpp"

namespace axisd::ssd2608pr {

/// The whole catalogue of manual 6.1, in order of address: 173 registers.
std::span<const ParameterSpec> parameters();

}  // namespace axisd::ssd2608pr
