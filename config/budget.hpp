// What the buses of a configuration can promise (buses/budget.md).
#pragma once

#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "devices/budget.hpp"

namespace axisd::config {

/// By the service as it is installed: from the moment from which a daemon that hangs does nothing any more
/// until systemd has killed it (WatchdogSec, and the 250 ms by which systemd's timers may be late).
inline constexpr Duration killed_within = std::chrono::milliseconds(1250);
/// From there until `axisd --quiesce` has started and opened its buses.
inline constexpr Duration quiesce_begins_within = std::chrono::milliseconds(500);
/// Until it knows that a line has no echo, where the drive that it asks for that is silent.
inline constexpr Duration longest_echo = std::chrono::milliseconds(100);

/// One report per bus, lines first, both in the order of the file. Nothing is observed in it. Precondition:
/// the loader found no error in `configuration`.
std::vector<BusBudgetReport> budgets(const Configuration& configuration);

/// "line-a: utilisation 0.31 (all axes moving 2.87), last stop frame of 8 axes within 220 ms, ..."
std::string summary(const BusBudgetReport& report);

/// What a bus does not meet, one line each: "line-a: the last stop frame of all axes may take ...; lower
/// ...".
std::vector<std::string> warnings(const BusBudgetReport& report);
/// The same of all of them.
std::vector<std::string> warnings(const std::vector<BusBudgetReport>& reports);
/// All that is to be known of a good configuration and is none of its budgets: positions, starts, files and
/// roles. Precondition: the loader found no error in it.
std::vector<std::string> other_warnings(const Configuration& configuration);
/// The same of all buses, and other_warnings(). Precondition: that of budgets().
std::vector<std::string> warnings(const Configuration& configuration);

}  // namespace axisd::config
