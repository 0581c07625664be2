// A copy of what the daemon remembers, and its way back.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "buses/error.hpp"
#include "daemon/store/state_text.hpp"

namespace axisd::store {

/// `state.v1` as it is on the disk, also while a daemon saves: never half of it. Blocks on the disk. Errors:
/// storage.
[[nodiscard]] Result<std::string> back_up_state(const std::filesystem::path& directory);

/// Durably puts a backup in the place of what is in the directory, which nobody may use meanwhile. The
/// command journal goes aside (`journal.v1.damaged`), so that the next start convicts what it finds: a backup
/// is old, and nobody knows what was asked for since. Counts, latches and holds of what was there are not
/// lost. A crash in between leaves files of which a start says the same. Returns what was restored. Errors:
/// storage.
[[nodiscard]] Result<Generation> restore_state(const std::filesystem::path& directory,
                                               std::string_view backup);

}  // namespace axisd::store
