// YSS-C drives of one virtual CAN network of 1 Mbit/s that index. Each prints, and is false where a command
// failed, or a drive started more often than it was told to.
#pragma once

namespace axisd::bench {

/// Moves per second, frames of a move and the load of the bus, beside that of a bare SYNC loop.
bool run_index(int nodes, long moves);
/// Start skew of 2 to `nodes` members, while the others index.
bool run_groups(int nodes);

}  // namespace axisd::bench
