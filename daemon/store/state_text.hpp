// The persistent state as text: pure functions, no files.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "buses/error.hpp"
#include "daemon/store/line_text.hpp"
#include "devices/persistence.hpp"

namespace axisd::store {

/// One generation of the state file.
struct Generation {
  std::uint64_t number = 0;  ///< rises with every write
  StoredState state;
  bool operator==(const Generation&) const = default;
};

std::string encode(const Generation& generation);

/// Accepts exactly what encode() produces. Errors (all `storage`): damaged (length, checksum, content), or
/// intact but of another format version, which must not be taken for damage: see `newer_format`.
Result<Generation> decode(std::string_view text);

/// The file is intact, but written in a format that this build does not know.
bool newer_format(std::string_view text);

}  // namespace axisd::store
