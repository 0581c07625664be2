// How far the journal was durable, in a file of its own that is overwritten in place.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "daemon/store/state_text.hpp"

namespace axisd::store {

/// One line; of one pair each is as long as every other.
[[nodiscard]] std::string encode_mark(const JournalMark& mark);
/// nullopt: it is none, or not all of it.
[[nodiscard]] std::optional<JournalMark> decode_mark(std::string_view text);

}  // namespace axisd::store
