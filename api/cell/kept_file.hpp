// A file that is whole or not there: what axisd-cell keeps over restarts.
#pragma once

#include <optional>
#include <string>

#include "buses/error.hpp"

namespace axisd::cell {

/// What a file held. Nothing: there is none. A file that is damaged is put aside, with ".damaged" behind its
/// name. Blocks for the disk. Errors: storage (damaged, or not readable).
[[nodiscard]] Result<std::optional<std::string>> read_kept(const std::string& path);

/// Replaces it: after a crash it holds this, or what it held before. Blocks until it is on the disk. Errors:
/// storage.
[[nodiscard]] Result<void> write_kept(const std::string& path, const std::string& content);

}  // namespace axisd::cell
