#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "buses/latency_histogram.hpp"
#include "buses/transaction.hpp"

namespace axisd {

/// Transactions of which not a byte was sent, by cause.
struct Drops {
  std::uint64_t expired = 0, superseded = 0, lease_lost = 0,
                port_lost = 0,  ///< the port; on CAN also the node: it booted, or was not in step
      unsupported = 0;          ///< the port cannot do the serial settings
};

/// What became of those that went out.
struct Ends {
  std::uint64_t answered = 0, refused = 0,  ///< by the node: an exception, an abort
      no_reply = 0,                         ///< in time; also where a stop cut the wait
      damaged = 0,                          ///< the reply was no sound one
      failed = 0;                           ///< the port
};

/// What became of the transactions of one class: exchanges on a line, SDO transfers on a CAN network.
struct ClassStatistics {
  std::uint64_t sent = 0;   ///< those that went out, with or without a reply
  std::size_t waiting = 0;  ///< now
  std::size_t most_waiting = 0;
  /// From being asked for to the first byte, with the silence before it; on CAN to the end of the first
  /// frame. What waits for a silent node's next probe counts from there.
  LatencyHistogram queueing;
  /// From there to the end of the reply, or of the wait for it.
  LatencyHistogram exchange;
  Ends ends;
  Drops drops;
};

using StatisticsByClass = std::array<ClassStatistics, transaction_class_count>;

}  // namespace axisd
