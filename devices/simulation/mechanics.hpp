// The switches of the machine around a simulated drive (Mechanics), by the position of the shaft.
#pragma once

#include <cstdint>
#include <optional>

#include "devices/simulation/simulated_node.hpp"

namespace axisd::simulation {

/// The load is on the switch.
bool switch_active(const Mechanics& mechanics, SwitchKind kind, std::int64_t shaft);
/// Next position of the shaft in `direction` (1 or -1) at which a switch changes.
std::optional<std::int64_t> next_switch(const Mechanics& mechanics, std::int64_t shaft, int direction);

}  // namespace axisd::simulation
