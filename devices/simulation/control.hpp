// Commands to simulated drives: one line of text each, one line of text in reply.
#pragma once

#include <string>
#include <string_view>

#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/pty_line.hpp"
#include "devices/simulation/rtu_network.hpp"

namespace axisd::simulation {

/// Executes one of these, at the network's present time:
///   power N on|off; input N TERMINAL on|off|auto; alarm N CODE (0: its cause is gone); block N on|off (the
///   shaft cannot turn); push N PULSES (the load turns the shaft); pace N PERCENT (of the speed that
///   the motor is told, from its next motion on); shaft N; peek N REGISTER;
///   poke N REGISTER VALUE; eeprom N; fault KIND key=value ...; fault clear; cut; join; help
/// N is an address, or @K for the K-th drive of the line (two drives may have one address, or none). Replies
/// "ok ..." or "error ...". Thread: the network's.
std::string execute_control(RtuNetwork& network, std::string_view command);

/// The same on a CAN network, at the clock's present time; REGISTER is an object, index << 8 | sub-index.
/// Faults as parse_can_fault() has them. Thread: the clock's.
std::string execute_control(CanNodes& nodes, std::string_view command);

/// Those of RtuNetwork, and `hangup` and `replug` of the adapter. Thread: any.
std::string execute_control(PtyLine& line, std::string_view command);

}  // namespace axisd::simulation
