// What the buses of a configuration can promise (buses/budget.md).
#pragma once

#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "devices/budget.hpp"

namespace axisd::config {

/// One report per bus, lines first, both in the order of the file. Nothing is observed in it. Precondition:
/// the loader found no error in `configuration`.
std::vector<BusBudgetReport> budgets(const Configuration& configuration);

/// "line-a: utilisation 0.31 (all axes moving 2.87), last stop frame of 8 axes within 220 ms, ..."
std::string summary(const BusBudgetReport& report);

}  // namespace axisd::config
