#pragma once

#include <span>

#include "devices/descriptor.hpp"

namespace axisd::yss_c {

/// The whole object dictionary of chapter 7, in order of address (index << 8 | sub-index): 192 entries that
/// it prints and 4 that its counts imply. Constant-initialised: usable from the constructors of other
/// statics.
std::span<const ParameterSpec> parameters();

}  // namespace axisd::yss_c
