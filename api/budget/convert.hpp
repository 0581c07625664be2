// The bus budget as messages, for the server and for axisctl without one.
#pragma once

#include "axisd/v1/budget.pb.h"
#include "devices/budget.hpp"

namespace axisd::api {

void to_proto(const BusBudgetReport& from, v1::BusBudget& to);

}  // namespace axisd::api
