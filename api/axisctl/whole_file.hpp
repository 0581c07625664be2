#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

namespace axisd::axisctl {

/// Gives a file this content, whole and on the disk, or leaves what was there, and nothing beside it. 0, or
/// an errno. `mode`: for a new one, less the umask.
[[nodiscard]] int write_whole_file(const std::string& path, std::string_view text, mode_t mode);

}  // namespace axisd::axisctl
