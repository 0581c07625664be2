#pragma once

#include <filesystem>
#include <memory>

#include "daemon/store/file_store.hpp"
#include "daemon/store/journal_file.hpp"

namespace axisd::store {

/// Everything that outlives the daemon, in one directory: the state file and the journal, each of which
/// vouches for the other. Thread: core (created and destroyed there, too).
class KeptState {
 public:
  /// Locks the directory, judges what is in it and durably begins anew with that. Blocks on the disk. Errors:
  /// storage, with what to do.
  static Result<std::unique_ptr<KeptState>> open(const std::filesystem::path& directory, WallTime now,
                                                 Executor core, JournalOptions options = {});

  KeptState() = default;
  KeptState(const KeptState&) = delete;
  /// The journal is told of the last save, then it ends.
  ~KeptState();

  [[nodiscard]] FileStore& state() { return *store_; }
  [[nodiscard]] JournalFile& journal() { return *journal_; }

 private:
  std::unique_ptr<FileStore> store_;  ///< holds the lock
  std::unique_ptr<JournalFile> journal_;
};

}  // namespace axisd::store
