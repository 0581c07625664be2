#include "daemon/store/state_backup.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <utility>

#include "buses/file_descriptor.hpp"
#include "daemon/store/disk.hpp"
#include "daemon/store/found_file.hpp"
#include "daemon/store/journal_model.hpp"
#include "daemon/store/state_directory.hpp"
#include "daemon/store/state_pair.hpp"

namespace axisd::store {
namespace {

constexpr auto newest = "state.v1";
constexpr auto journal = "journal.v1";
constexpr std::size_t largest_state = 16U << 20U;
constexpr std::size_t largest_journal = std::size_t{256} << 20U;

Result<Generation> decode_backup(std::string_view text) {
  if (newer_format(text))
    return fail(Reason::storage, "the backup was written by a newer axisd", "restore it with that version");
  auto generation = decode(text);
  if (generation) return generation;
  return fail(Reason::storage, fmt::format("the backup cannot be used: {}", generation.error().message),
              "take another one");
}

/// What must not come a second time, and what somebody may still rely on.
void keep(const StateLine& present, Generation& restored) {
  auto& state = restored.state;
  restored.number = std::max(restored.number, present.generation + 1);
  state.start_count = std::max(state.start_count, present.start_count);
  if (present.inhibit.active && !state.inhibit.active) state.inhibit = present.inhibit;
  for (const auto& [axis, holds] : present.holds) state.axes[axis].holds.insert(holds.begin(), holds.end());
}

/// An EEPROM does not get younger.
void keep_counts(const StoredState& present, StoredState& restored) {
  for (const auto& [name, axis] : present.axes) {
    auto& kept = restored.axes[name];
    kept.eeprom_writes = std::max(kept.eeprom_writes, axis.eeprom_writes);
    if (axis.eeprom.saves >= kept.eeprom.saves) kept.eeprom = axis.eeprom;
  }
}

}  // namespace

Result<std::string> back_up_state(const std::filesystem::path& directory) {
  const auto path = directory / newest;
  const FileDescriptor folder(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0) return disk_failed("open", directory, errno);
  auto found = find_file(folder.get(), newest, largest_state);
  if (found.kind == FoundFile::Kind::unreadable) return disk_failed("read", path, found.error);
  if (!found.regular())
    return fail(Reason::storage,
                fmt::format("{} is {}", path.string(), found.what.empty() ? "missing" : found.what),
                "look at the state directory");
  if (auto good = decode_backup(found.text); !good) return fail(good.error());
  return std::move(found.text);
}

Result<Generation> restore_state(const std::filesystem::path& directory, std::string_view backup) {
  auto restored = decode_backup(backup);
  if (!restored) return restored;
  auto opened = StateDirectory::open(directory);
  if (!opened) return fail(opened.error());
  const auto files = opened->find();
  if (!files) return fail(files.error());
  for (const auto* file : {&files->newest, &files->previous}) {
    if (!file->regular()) continue;
    if (newer_format(file->text))
      return fail(Reason::storage, fmt::format("{} holds the state of a newer axisd", directory.string()),
                  "run that version, or restore into an empty directory");
    const auto present = decode(file->text);
    if (!present) continue;
    keep(line_of(*present), *restored);
    keep_counts(present->state, restored->state);
  }
  const FileDescriptor folder(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0) return disk_failed("open", directory, errno);
  const auto found = find_file(folder.get(), journal, largest_journal);
  if (found.regular()) {
    const auto known = load_journal(found.text);
    if (known.model.state()) keep(*known.model.state(), *restored);
  }
  // First: without it each of the files that are left is convicted.
  if (const int error = move_aside(folder.get(), journal); error != 0)
    return disk_failed("move aside", directory / journal, error);
  auto& mark = restored->journal;
  if (mark.pair.empty()) mark.pair = "restored";
  mark.line = std::max<std::uint64_t>(mark.line, 1);  // it had a journal, which is not there
  if (auto saved = opened->save(encode(*restored)); !saved) return fail(saved.error());
  return restored;
}

}  // namespace axisd::store
