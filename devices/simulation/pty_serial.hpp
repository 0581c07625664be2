// Serial settings of a pseudo terminal, seen from its master.
#pragma once

#include <optional>

#include "devices/simulation/simulated_node.hpp"

namespace axisd::simulation {

/// What a client finds when it opens the terminal: raw, with these settings (any rate, also 14400 or 128000).
/// False: the terminal is gone.
bool set_pty_serial(int master, const Serial& serial);
/// What the client has set. A pty clears the parity (and keeps 8 bits): it is `configured`'s and hidden, so
/// that drives with any parity hear it. Nothing: the terminal is gone.
std::optional<Serial> pty_serial(int master, const Serial& configured);

}  // namespace axisd::simulation
