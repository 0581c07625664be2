// What became of StopAll, axis by axis.
#pragma once

#include <cstdint>

#include "api/axisctl/invocation.hpp"
#include "axisd/v1/system_service.pb.h"

namespace axisd::axisctl {

enum class Results : std::uint8_t { all, failed };

/// Prints them, unless as JSON; the exit status tells where an axis did not stop.
void print_results(Invocation& invocation, const v1::StopAllResponse& response, Results which);
/// Where the latch is not on the machine's disk: a restart would forget it.
void complain_of_latch(Invocation& invocation, const v1::StopAllResponse& response);

}  // namespace axisd::axisctl
