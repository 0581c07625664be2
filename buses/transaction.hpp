#pragma once

#include <cstdint>
#include <string_view>

#include "buses/clock.hpp"
#include "buses/gate.hpp"

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
};

}  // namespace axisd
