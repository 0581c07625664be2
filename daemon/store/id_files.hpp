// Files of ids of commands that have ended, next to the journal, which names them and says how much of each
// counts.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "daemon/store/journal_disk.hpp"
#include "daemon/store/journal_text.hpp"
#include "devices/axis/id_limits.hpp"

namespace axisd::store {

/// How much of what has ended is kept over a restart.
struct IdBounds {
  /// Ids, beyond those that were heard of within `remembered_at_least`: of these the command book has a
  /// bounded number.
  std::size_t most = IdLimits{}.total + IdLimits{}.reserve();
};

/// Durably puts the runs behind the newest file, or into a new one. The answer is to be said in the journal:
/// until then they do not count. Errors: storage.
Result<IdsLine> append_ids(JournalDisk& disk, const std::vector<IdsLine>& files,
                           const std::vector<ClientRun>& runs);

/// Those that still hold what is remembered.
std::vector<IdsLine> still_needed(std::vector<IdsLine> files, Duration now, const IdBounds& bounds);

struct IdsLoad {
  std::vector<IdsLine> files;  ///< as far as they are intact
  std::vector<ClientRun> runs;
  std::string damage;  ///< empty: none
};
/// Errors: storage: a file is there and cannot be read.
Result<IdsLoad> load_ids(JournalDisk& disk, const std::vector<IdsLine>& files);

}  // namespace axisd::store
