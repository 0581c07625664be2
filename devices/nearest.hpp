// The name that somebody probably meant.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/error.hpp"

namespace axisd {

/// The candidate with the least edit distance, if it is near enough to be a typing error; else empty.
std::string_view nearest(std::string_view text, std::span<const std::string_view> candidates);

/// "did you mean 'feeder'?", or `otherwise` where nothing is near.
std::string did_you_mean(std::string_view text, const std::vector<std::string>& candidates,
                         std::string_view otherwise);

/// The error for an axis of which the configuration knows nothing. `axes`: those that it has.
Error no_such_axis(std::string_view name, const std::vector<std::string>& axes);
/// The same for a group. `axes`: whose names are no groups'.
Error no_such_group(std::string_view name, const std::vector<std::string>& groups,
                    const std::vector<std::string>& axes);

}  // namespace axisd
