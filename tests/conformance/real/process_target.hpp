// The real programs on a real network interface, in real time.
#pragma once

#include <memory>
#include <string>

#include "tests/conformance/target.hpp"

namespace axisd::conformance {

struct Programs {
  std::string axisd, axisd_sim;
};

/// axisd and axisd-sim on the CAN interface `interface`, which is up. The plant's network goes there. Throws
/// std::invalid_argument if axisd refuses the plant's YAML, with what it said; std::runtime_error if a
/// program does not come up.
std::unique_ptr<Target> make_process_target(const Programs& programs, const std::string& interface,
                                            const Plant& plant);

}  // namespace axisd::conformance
