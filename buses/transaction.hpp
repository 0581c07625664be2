#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "buses/clock.hpp"
#include "buses/gate.hpp"
#include "buses/modbus_rtu/settings.hpp"

namespace axisd {

/// Order in which a bus serves what waits for it: strict, with one reservation against starvation.
enum class TransactionClass : std::uint8_t {
  stop,          ///< halt, stop, quick stop, release as an escalation
  motion,        ///< everything that prepares or starts a motion
  moving_state,  ///< state of axes that move or stop
  idle_state,    ///< state of axes at rest
  parameters,    ///< configuration, parameters, other devices
  scan,          ///< bus scan, probes of nodes that do not answer
};
inline constexpr int transaction_class_count = 6;
std::string_view to_string(TransactionClass transaction_class);

/// How and when a transaction may go out.
struct TransactionOptions {
  TransactionClass transaction_class = TransactionClass::parameters;
  TimePoint deadline = TimePoint::max();  ///< not sent after this
  MotionGuard guard{};                    ///< for motion frames
  /// Of a reading in class moving_state on an RS-485 line: from then on its answer is likely to end a
  /// command. Until it has gone out its class goes before starts then, as far as these can wait.
  TimePoint awaited_from = TimePoint::max();
  /// Of a request to the drive of an axis: others than the axis wait for it. Whether the axis starts or stops
  /// neither hastens nor ends it, and no reading of the axis joins it.
  bool of_others = false;
  /// Of a stop that was sent in vain before: while its node does not answer anything, it is repeated as
  /// seldom as the node is probed.
  bool patient = false;
  /// Of this node in this exchange (saving to an EEPROM takes long); nothing: the bus's. A stop still cuts
  /// the wait after the bus's: its bound is worth more than a reply that may collide with it.
  std::optional<Duration> turnaround_max{};
  /// The line is switched to these for this exchange alone; nothing: the bus's own. Noise to every other
  /// node: never for classes stop and motion.
  std::optional<modbus_rtu::SerialSettings> serial{};
};

}  // namespace axisd
