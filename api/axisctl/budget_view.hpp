// The bus budget as text for people. Pure.
#pragma once

#include <string>

#include "axisd/v1/budget.pb.h"
#include "axisd/v1/group_service.pb.h"

namespace axisd::axisctl {

/// Tables of load, of stops, of each of `groups` with axes on this bus, and of each axis; beside the
/// predicted times those that were seen, if any were. `columns` > 0: tables are folded to that width.
std::string budget_text(const v1::BusBudget& budget, const v1::ListGroupsResponse& groups, bool colour,
                        int columns = 0);

}  // namespace axisd::axisctl
