// Error codes of 603Fh and EMCY as CiA 402 and CiA 301 define them, for drives that have no table of their
// own.
#pragma once

#include <span>

#include "devices/descriptor.hpp"

namespace axisd::cia402_eds {

/// CiA 402 resets every fault by the same command, as soon as its cause is gone.
std::span<const AlarmSpec> alarms();
/// As DriveDescriptor::other_alarms: there is a row for every code that alarms() does not have.
std::span<const AlarmSpec> other_alarms();

}  // namespace axisd::cia402_eds
