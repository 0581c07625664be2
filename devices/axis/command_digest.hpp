// The content of a request: as text that tells equal ones from others, and as values.
#pragma once

#include <string>

#include "devices/axis/command.hpp"

namespace axisd {

/// Equal exactly for equal requests. Kept over restarts: a change of this makes repeats conflicts.
std::string digest(const std::string& axis, const Action& action);
/// What Command::asked says of it.
MotionValues asked_by(const Action& action);

}  // namespace axisd
