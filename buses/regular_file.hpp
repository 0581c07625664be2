#pragma once

#include <cstddef>
#include <string>

#include "buses/error.hpp"

namespace axisd {

/// The content of a file that a configuration names. Neither waits nor reads without end: what is no regular
/// file (a pipe, a device, a directory) is refused before anything is read of it, and so are more than `most`
/// bytes. Errors: invalid_argument, with the path. Thread: any.
[[nodiscard]] Result<std::string> read_regular_file(const std::string& path, std::size_t most);

}  // namespace axisd
