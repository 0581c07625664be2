// The scenarios against the real axisd and axisd-sim on vcan interfaces, in real time.
#pragma once

#include <string_view>

#include "tests/conformance/real/process_target.hpp"

namespace axisd::conformance {

/// Every model on CAN, plain and inverted, several at once: they mostly wait. Prints a line for each. Makes
/// the interfaces, which takes privileges: for the guest of tests/guest. `named`: only scenarios whose name
/// has this in it. The number of those that failed; -1: there is none.
int run_vcan_suite(const Programs& programs, std::string_view named);

}  // namespace axisd::conformance
