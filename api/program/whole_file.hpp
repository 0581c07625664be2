#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

namespace axisd::program {

/// Who owns a file that is written.
enum class FileOwner {
  writer,     ///< whoever writes it
  of_folder,  ///< where root writes it, the owner of the folder: a service that runs as that user
};

/// Gives a file this content, whole and on the disk, or leaves what was there, and nothing beside it. 0, or
/// an errno. `mode`: less the umask. Blocks for the disk. Thread: any; one writer a file.
[[nodiscard]] int write_whole_file(const std::string& path, std::string_view text, mode_t mode,
                                   FileOwner owner = FileOwner::writer);

}  // namespace axisd::program
