// The bus budget as text for people. Pure.
#pragma once

#include <string>

#include "axisd/v1/budget.pb.h"

namespace axisd::axisctl {

/// Tables of load, of stops, and of each axis; beside the predicted times those that were seen, if any were.
std::string budget_text(const v1::BusBudget& budget, bool colour);

}  // namespace axisd::axisctl
