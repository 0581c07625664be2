// Commands to a running simulated line: one line of text each, one line of text in reply.
#pragma once

#include <string>
#include <string_view>

#include "devices/simulation/pty_line.hpp"

namespace axisd::simulation {

/// Executes `power N on|off`, `input N X3 on|off|auto`, `alarm N CODE`, `fault KIND key=value ...`, `fault
/// clear`, `cut`, `join`, `hangup`, `replug`, `shaft N`, `peek N REGISTER`, `poke N REGISTER VALUE`, `eeprom
/// N` or `help`. Replies "ok ..." or "error ...". Thread: any.
std::string execute_control(PtyLine& line, std::string_view command);

}  // namespace axisd::simulation
