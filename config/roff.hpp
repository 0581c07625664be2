// Text for manual pages.
#pragma once

#include <string>
#include <string_view>

namespace axisd::config {

/// Text as roff prints it: "-" stays one, and no line is taken for a request.
std::string roff(std::string_view text);

}  // namespace axisd::config
