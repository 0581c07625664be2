// Several nodes start with one SYNC (M24): what waits in them for it, and what happens if anything goes
// wrong.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "buses/canopen/object.hpp"
#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "buses/gate.hpp"
#include "buses/task.hpp"

namespace axisd::canopen {

class CanopenBus;

/// A node's part. Its functions are called on the core thread, until the start has ended.
struct SyncStart {
  std::uint8_t node = 0;             ///< attached to the bus
  std::uint32_t cob_id = 0;          ///< of an RPDO that is applied at the next SYNC
  Bytes arm;                         ///< what starts it
  std::vector<MotionGuard> guards;   ///< asked for this frame, and for the SYNC
  std::function<Bytes()> neutral{};  ///< what takes its place when the start is given up
  /// Reads back that the node took the SYNC: then nothing waits there any more.
  std::function<Task<Result<void>>()> confirm{};
};

/// As CanopenBus::start_together().
Task<Result<TimePoint>> common_start(CanopenBus& bus, std::vector<SyncStart> members, TimePoint not_before);

/// Runs `function` for 0 to `count` - 1 side by side, to their ends. It outlives them.
Task<> for_each_at_once(Executor executor, Clock& clock, std::size_t count,
                        std::function<Task<>(std::size_t)> function);

}  // namespace axisd::canopen
