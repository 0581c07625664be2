// The name that somebody probably meant.
#pragma once

#include <span>
#include <string_view>

namespace axisd {

/// The candidate with the least edit distance, if it is near enough to be a typing error; else empty.
std::string_view nearest(std::string_view text, std::span<const std::string_view> candidates);

}  // namespace axisd
