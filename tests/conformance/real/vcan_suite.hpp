// The scenarios against the real axisd and axisd-sim on a vcan interface.
#pragma once

#include <string_view>

#include "tests/conformance/real/process_target.hpp"

namespace axisd::conformance {

/// Of all that there is to run, every `of`-th, beginning with `part` (from 1): for guests side by side.
struct Part {
  std::size_t part = 1, of = 1;
};

/// Every scenario on every model on CAN and every data sheet of a maker that is there, motion also inverted,
/// one after the other on the interface vcan0, in the time of a guest (tests/guest/run.sh -v). Prints a line
/// for each. `named`: only those with this in "MODEL SCENARIO". True: there were some, and all passed.
bool run_vcan_suite(const Programs& programs, std::string_view named);

/// Every scenario, in so many parts: those of motion and stop on each model, the others on one of them in
/// turn; and some on each data sheet of a maker that is there.
bool run_vcan_sample(const Programs& programs, const Part& part);

}  // namespace axisd::conformance
