// A day in the life of an axis, compact: everything that may cost it its position, judged against the load.
#pragma once

#include <cstdint>

#include "tests/rules/model_rig.hpp"

namespace axisd::test {

/// Enables, homes, moves, stops, releases, turns the shaft by hand, hits limits, raises alarms, switches the
/// drive off, restarts the daemon, and fails the test (gtest) where an axis at rest believes in a position at
/// which the load is not, or where a relative move that is Done went another way than was asked. Returns what
/// went over the wire, as a number: equal for drives that behaved alike.
std::uint64_t travel(const ModelRigOptions& options);

}  // namespace axisd::test
