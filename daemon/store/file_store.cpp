#include "daemon/store/file_store.hpp"

#include <utility>

#include "daemon/store/thread.hpp"

namespace axisd::store {

Result<std::unique_ptr<FileStore>> FileStore::open(const std::filesystem::path& directory, Executor core) {
  auto opened = StateDirectory::open(directory);
  if (!opened) return std::unexpected(opened.error());
  auto found = opened->load();
  if (!found) return std::unexpected(found.error());
  auto generation = std::move(found->generation).value_or(Generation{});
  if (found->damage) {
    distrust(generation.state, std::chrono::system_clock::now());
    if (auto moved = opened->set_aside(); !moved) return std::unexpected(moved.error());
  }
  std::unique_ptr<FileStore> store(
      new FileStore(std::move(*opened), std::move(generation), std::move(found->damage), std::move(core)));
  if (auto counted = store->count_this_start(); !counted) return std::unexpected(counted.error());
  store->thread_ = start_thread([self = store.get()] { self->run(); });
  return store;
}

FileStore::FileStore(StateDirectory directory, Generation loaded, std::optional<Error> damage, Executor core)
    : core_(std::move(core)),
      damage_(std::move(damage)),
      directory_(std::move(directory)),
      durable_(std::move(loaded)) {}

FileStore::~FileStore() {
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock(mutex_);
    closing_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

Result<void> FileStore::count_this_start() {
  ++durable_.state.start_count;
  // Twice: then the generation before knows this start, too, and falling back on it cannot repeat a start
  // count.
  for (int generation = 0; generation < 2; ++generation) {
    if (auto written = write(durable_.state); !written) return written;
  }
  loaded_ = *current_ = durable_.state;
  return {};
}

void FileStore::save_offset(std::string axis, OffsetRecord offset, Callback done) {
  enqueue(SetOffset{.axis = std::move(axis), .offset = offset}, std::move(done));
}

void FileStore::forget_offset(std::string axis, Callback done) {
  enqueue(ForgetOffset{.axis = std::move(axis)}, std::move(done));
}

void FileStore::save_inhibit(InhibitRecord inhibit, Callback done) {
  enqueue(SetInhibit{.inhibit = std::move(inhibit)}, std::move(done));
}

void FileStore::save_hold(std::string axis, HoldKey hold, WallTime since, Callback done) {
  enqueue(SetHold{.axis = std::move(axis), .hold = std::move(hold), .since = since}, std::move(done));
}

void FileStore::forget_holds(std::string axis, HoldRecords holds, Callback done) {
  enqueue(ForgetHolds{.axis = std::move(axis), .holds = std::move(holds)}, std::move(done));
}

void FileStore::count_eeprom_writes(std::string axis, std::uint64_t writes, EepromRecord saves,
                                    Callback done) {
  enqueue(CountEepromWrites{.axis = std::move(axis), .writes = writes, .saves = std::move(saves)},
          std::move(done));
}

void FileStore::enqueue(Change change, Callback done) {
  store::apply(*current_, change);
  {
    const std::scoped_lock lock(
        mutex_);  // held by the writer only for a swap: the core does not wait for the disk
    pending_.push_back({.change = std::move(change), .done = std::move(done)});
  }
  wake_.notify_one();
}

void FileStore::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return closing_ || !pending_.empty(); });
    auto batch = std::exchange(pending_, {});
    const bool last = closing_ && batch.empty();
    lock.unlock();
    // An empty last batch retries what an earlier failure left unsaved; there is no one left to tell.
    if (!batch.empty() || disk_differs_) commit(std::move(batch));
    if (last) return;
    lock.lock();
  }
}

void FileStore::commit(std::vector<Pending> batch) {
  auto next = durable_.state;
  for (const auto& pending : batch) apply(next, pending.change);
  Result<void> result;
  if (disk_differs_ || next != durable_.state) result = write(next);
  if (!result) {
    for (const auto& pending : batch) apply_after_failure(durable_.state, pending.change);
  }
  for (auto& pending : batch) report(std::move(pending), result);
}

Result<void> FileStore::write(const StoredState& state) {
  Generation next{.number = durable_.number + 1, .state = state};
  auto saved = directory_.save(encode(next));
  disk_differs_ = !saved;
  if (saved) durable_ = std::move(next);
  return saved;
}

void FileStore::report(Pending pending, const Result<void>& result) {
  if (!pending.done && result) return;
  post(core_, [pending = std::move(pending), result, current = std::weak_ptr(current_)] {
    if (const auto alive = current.lock(); alive && !result) apply_after_failure(*alive, pending.change);
    if (pending.done) pending.done(result);
  });
}

}  // namespace axisd::store
