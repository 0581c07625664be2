#pragma once

#include <span>

#include "devices/descriptor.hpp"

namespace axisd::ykd2405pr {

/// The whole catalogue of manual 6.1, in order of address: 148 registers.
std::span<const ParameterSpec> parameters();

}  // namespace axisd::ykd2405pr
