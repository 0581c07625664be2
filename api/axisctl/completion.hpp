// Bash completion, generated from the command line's own definition so that it cannot fall behind.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace axisd::axisctl {

/// A script to be evaluated by bash 4.4 or later.
std::string bash_completion(const CLI::App& app);

}  // namespace axisd::axisctl
