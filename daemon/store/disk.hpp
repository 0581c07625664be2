// Writing to the disk of the state directory, and what is said where it refuses.
#pragma once

#include <expected>
#include <filesystem>
#include <string_view>

#include "buses/error.hpp"

namespace axisd::store {

/// "cannot write /var/lib/axisd/journal.v1: No space left on device; free space on the disk" (storage).
/// `error`: an errno.
[[nodiscard]] std::unexpected<Error> disk_failed(std::string_view what, const std::filesystem::path& path,
                                                 int error);

/// All of `text`, where the file is at. 0, or an errno: a part of it may be written then.
[[nodiscard]] int write_all(int file, std::string_view text);

}  // namespace axisd::store
