// The manual page, generated from the command line's own definition so that it cannot fall behind.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace axisd::axisctl {

/// axisctl(1), in the language of man(7).
std::string man_page(const CLI::App& app);

}  // namespace axisd::axisctl
