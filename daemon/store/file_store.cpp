#include "daemon/store/file_store.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/store/thread.hpp"

namespace axisd::store {

namespace {

/// The axis rests elsewhere, and its counter means what it meant: until this is saved the older record fits
/// nowhere but where the axis was. A record with another meaning fits where it is, and is not waited with.
bool only_moved(const StoredState& state, const Change& change) {
  const auto* set = std::get_if<SetOffset>(&change);
  if (set == nullptr) return false;
  const auto axis = state.axes.find(set->axis);
  if (axis == state.axes.end() || !axis->second.offset) return false;
  auto moved = *axis->second.offset;
  if (moved.last_position_pulses == set->offset.last_position_pulses) return false;
  moved.last_position_pulses = set->offset.last_position_pulses;
  moved.canary = set->offset.canary;
  return moved == set->offset;
}

}  // namespace

Result<std::unique_ptr<FileStore>> FileStore::begin(StateDirectory directory, Generation found,
                                                    KeptStateSeen seen, Executor core, SaveDelays delays) {
  std::unique_ptr<FileStore> store(
      new FileStore(std::move(directory), std::move(found), seen, std::move(core), delays));
  auto counted = store->durable_.state;
  ++counted.start_count;
  if (auto written = store->write(counted, store->durable_.state); !written) return fail(written.error());
  store->loaded_ = *store->current_ = store->durable_.state;
  return store;
}

Result<void> FileStore::serve(StateWitness& witness) {
  witness_ = &witness;
  // The second time: then the generation before knows this start, too, and falling back on it cannot repeat a
  // start count.
  if (auto written = write(durable_.state, durable_.state); !written) return written;
  thread_ = start_thread("axisd-state", [this] { run(); });
  return {};
}

FileStore::FileStore(StateDirectory directory, Generation found, KeptStateSeen seen, Executor core,
                     SaveDelays delays)
    : core_(std::move(core)),
      delays_(delays),
      seen_(seen),
      directory_(std::move(directory)),
      durable_(std::move(found)) {}

void FileStore::close() {
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock(mutex_);
    closing_ = true;
  }
  wake_.notify_one();
  thread_.join();
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

void FileStore::accept_state(Callback done) { enqueue(AcceptState{}, std::move(done)); }

void FileStore::enqueue(Change change, Callback done) {
  const auto now = monotonic_now();
  const bool may_wait = !done && only_moved(*current_, change);
  store::apply(*current_, change);
  bool sooner = false;
  {
    // Held by the writer only for a swap: the core does not wait for the disk.
    const std::scoped_lock lock(mutex_);
    if (pending_.empty()) save_latest_ = now + delays_.latest;
    save_at_ = may_wait ? std::min(now + delays_.settled, save_latest_) : now;
    if (!may_wait) save_latest_ = now;
    // What has passed already is waited for still where the computer was suspended: the wait does not count
    // that.
    sooner = waits_until_ != TimePoint{} && (save_at_ < waits_until_ || waits_until_ <= now);
    pending_.push_back({.change = std::move(change), .done = std::move(done)});
  }
  if (sooner) wake_.notify_one();
}

void FileStore::wait_for_work(std::unique_lock<std::mutex>& lock) {
  for (;;) {
    const auto until = pending_.empty() ? look_at_ : save_at_;
    const auto left = until - monotonic_now();
    if (closing_ || left <= Duration{}) return;
    waits_until_ = until;
    wake_.wait_for(lock, left);
    waits_until_ = {};
  }
}

void FileStore::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wait_for_work(lock);
    auto batch = std::exchange(pending_, {});
    const bool last = closing_ && batch.empty();
    lock.unlock();
    // All that the journal was told is on the disk then, and so is to be known, too.
    if (last) (void)tell_journal(durable_);
    const bool look = last || monotonic_now() >= look_at_;
    if (look) look_at_ = monotonic_now() + delays_.known;
    const bool mark = look && journal_is_ahead();
    // An empty last batch retries what an earlier failure left unsaved; there is no one left to tell.
    if (!batch.empty() || mark || (last && disk_differs_)) commit(std::move(batch), mark);
    if (last) return;
    lock.lock();
  }
}

void FileStore::commit(std::vector<Pending> batch, bool mark) {
  auto next = durable_.state;
  for (const auto& pending : batch) apply(next, pending.change);
  Result<void> result;
  if (disk_differs_ || mark || next != durable_.state) {
    auto cautious = durable_.state;
    for (const auto& pending : batch) apply_after_failure(cautious, pending.change);
    result = write(next, cautious);
    if (!result) {
      const bool in_one_file = durable_.state == next;
      durable_.state = cautious;
      // What was not granted must not stand in either of them.
      if (in_one_file && cautious != next) (void)write(cautious, cautious);
    }
  }
  for (auto& pending : batch) report(std::move(pending), result);
}

/// Into both files: what one of them lost the other has.
Result<void> FileStore::write(const StoredState& state, const StoredState& after_failure) {
  Generation next{.number = durable_.number + 1, .journal = durable_.journal, .state = state};
  if (witness_ != nullptr) next.journal.line = witness_->durable_line();
  const auto saved = directory_.save(encode(next));
  if (saved)
    durable_ = std::move(next);
  else
    durable_.state = after_failure;  // of a generation that may be on the disk the journal does not know
  const auto told = tell_journal(durable_);
  disk_differs_ = !saved || !told;
  look_at_ = monotonic_now() + delays_.known;
  return saved ? told : saved;
}

Result<void> FileStore::tell_journal(const Generation& generation) {
  if (witness_ == nullptr) return {};
  return witness_->note(line_of(generation));
}

bool FileStore::journal_is_ahead() const {
  return witness_ != nullptr && witness_->durable_fact() > durable_.journal.line;
}

void FileStore::report(Pending pending, const Result<void>& result) {
  if (!pending.done && result) return;
  post(core_, [pending = std::move(pending), result, current = std::weak_ptr(current_)] {
    if (const auto alive = current.lock(); alive && !result) apply_after_failure(*alive, pending.change);
    if (pending.done) pending.done(result);
  });
}

}  // namespace axisd::store
