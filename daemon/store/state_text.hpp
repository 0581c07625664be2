// The persistent state as text: pure functions, no files.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "buses/error.hpp"
#include "daemon/store/line_text.hpp"
#include "devices/persistence.hpp"

namespace axisd::store {

/// Which journal a state file belongs to.
struct JournalMark {
  std::string pair{};      ///< both files have it; empty: the file is of before there was one
  std::uint64_t line = 0;  ///< the journal had this one when the state was saved; 0: there was no journal yet
  bool operator==(const JournalMark&) const = default;
};

/// One generation of the state file.
struct Generation {
  std::uint64_t number = 0;  ///< rises with every write
  JournalMark journal{};
  StoredState state;
  bool operator==(const Generation&) const = default;
};

/// In the format of before where there is no mark.
std::string encode(const Generation& generation);

/// Accepts exactly what encode() produces. Errors (all `storage`): damaged (length, checksum, content), or
/// intact but of another format version, which must not be taken for damage: see `newer_format`.
Result<Generation> decode(std::string_view text);

/// The file is intact, but written in a format that this build does not know.
bool newer_format(std::string_view text);

}  // namespace axisd::store
