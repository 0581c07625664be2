#include "daemon/store/kept_state.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <random>
#include <utility>

#include "daemon/store/state_pair.hpp"

namespace axisd::store {
namespace {

std::string new_pair() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

}  // namespace

KeptState::~KeptState() {
  if (store_) store_->close();
}

Result<std::unique_ptr<KeptState>> KeptState::open(const std::filesystem::path& directory, WallTime now,
                                                   Executor core, JournalOptions options) {
  auto opened = StateDirectory::open(directory);
  if (!opened) return fail(opened.error());
  auto files = opened->find();
  if (!files) return fail(files.error());
  auto disk = open_journal_disk(directory);
  if (!disk) return fail(disk.error());
  auto journal = (*disk)->read();
  if (!journal) return fail(journal.error());
  auto mark = (*disk)->read_mark();
  if (!mark) return fail(mark.error());
  auto verdict = judge({.state = std::move(files->newest),
                        .previous = std::move(files->previous),
                        .journal = *std::move(journal),
                        .mark = *std::move(mark)},
                       new_pair(), now);
  if (!verdict) return fail(verdict.error());
  for (const auto& conviction : verdict->fresh)
    spdlog::error("{}: {}", directory.string(), to_string(conviction));
  for (const auto file : verdict->aside)
    if (auto moved = opened->set_aside(file); !moved) return fail(moved.error());

  auto kept = std::make_unique<KeptState>();
  auto store = FileStore::begin(*std::move(opened), std::move(verdict->state), verdict->seen, core);
  if (!store) return fail(store.error());
  options.state = (*store)->line();
  options.doubt = std::move(verdict->doubt);
  options.last_number = verdict->seen.journal.expected;
  auto begun = JournalFile::begin(*std::move(disk), std::move(verdict->journal), now, std::move(core),
                                  std::move(options));
  if (!begun) return fail(begun.error());
  kept->journal_ = *std::move(begun);
  kept->store_ = *std::move(store);
  if (auto serves = kept->store_->serve(*kept->journal_); !serves) return fail(serves.error());
  return kept;
}

}  // namespace axisd::store
