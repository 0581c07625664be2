#pragma once

#include <string>
#include <string_view>

namespace axisd::test {

/// Where a file of the source tree lies. `relative`: from its root.
std::string in_source_tree(std::string_view relative);

}  // namespace axisd::test
