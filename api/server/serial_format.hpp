// Serial formats as texts, "8N1".
#pragma once

#include <string>
#include <string_view>

#include "buses/error.hpp"
#include "buses/modbus_rtu/settings.hpp"

namespace axisd::server {

/// Errors: invalid_argument, naming what is permitted.
[[nodiscard]] Result<modbus_rtu::Format> parse_format(std::string_view text);
[[nodiscard]] std::string to_text(modbus_rtu::Format format);

}  // namespace axisd::server
