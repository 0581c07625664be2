#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "buses/error.hpp"
#include "buses/file_descriptor.hpp"
#include "daemon/store/found_file.hpp"

namespace axisd::store {

/// The file behind the command journal. Thread: one at a time.
class JournalDisk {
 public:
  virtual ~JournalDisk() = default;
  /// As it is found. Errors: storage: it cannot be read.
  [[nodiscard]] virtual Result<FoundFile> read() = 0;
  /// Appends; survives the end of the daemon, and that of the computer once sync() has returned. Errors:
  /// storage: what is at the end of the file is not known then.
  [[nodiscard]] virtual Result<void> append(std::string_view text) = 0;
  [[nodiscard]] virtual Result<void> sync() = 0;
  /// Durably replaces the whole file: at no moment is there none. Errors: storage: it is the old one or the
  /// new one.
  [[nodiscard]] virtual Result<void> replace(std::string_view text) = 0;
  /// Keeps the present file, whatever it is, by another name: a person may want to look at it.
  [[nodiscard]] virtual Result<void> keep_damaged() = 0;

  /// What mark() left; absent or damaged: nobody knows. Errors: storage.
  [[nodiscard]] virtual Result<FoundFile> read_mark() = 0;
  /// Writes into a small file beside it, over what was there: survives the end of the daemon, not surely that
  /// of the computer. Errors: storage.
  [[nodiscard]] virtual Result<void> mark(std::string_view text) = 0;

  // Files beside it, by number.
  /// Durably writes behind the first `offset` bytes; what was there is gone. Errors: storage: what is there
  /// is not known.
  [[nodiscard]] virtual Result<void> append_ids(std::uint32_t file, std::uint64_t offset,
                                                std::string_view bytes) = 0;
  /// At most `most` bytes from its beginning; none: it is not there. Errors: storage.
  [[nodiscard]] virtual Result<std::string> read_ids(std::uint32_t file, std::uint64_t most) = 0;
  /// Removes all others, as far as that goes.
  virtual void keep_ids(const std::vector<std::uint32_t>& files) = 0;
};

/// `journal.v1` and `journal-ids-N.v1` in a directory, which the caller has locked. Errors: storage.
Result<std::unique_ptr<JournalDisk>> open_journal_disk(const std::filesystem::path& directory);

}  // namespace axisd::store
