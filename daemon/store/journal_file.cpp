#include "daemon/store/journal_file.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/smart_ptr/make_shared.hpp>
#include <chrono>
#include <fstream>
#include <random>
#include <utility>
#include <variant>

#include "buses/limited_log.hpp"
#include "daemon/store/journal_mark.hpp"
#include "daemon/store/thread.hpp"

namespace axisd::store {
namespace {

/// A disk that failed is tried again so often.
constexpr auto retry = std::chrono::seconds(1);
/// The file is written anew when it has grown to twice what it was, and to this at least.
constexpr std::size_t smallest_rewrite = std::size_t{1} << 20U;
/// Commands that have ended and are kept with all that is known of them.
constexpr std::size_t kept_in_full = 1'000;
/// What time it is is written so often at most: what is heard of meanwhile counts as heard of before.
constexpr Duration time_told = std::chrono::seconds(1);

}  // namespace

Result<std::unique_ptr<JournalFile>> JournalFile::begin(std::unique_ptr<JournalDisk> disk,
                                                        std::optional<JournalLoad> found, WallTime now,
                                                        Executor core, JournalOptions options) {
  std::unique_ptr<JournalFile> journal(new JournalFile(std::move(disk), std::move(core), std::move(options)));
  // Before anything is written: what is in the place of a journal that cannot be used is kept.
  if (!journal->options_.doubt.empty())
    if (auto kept = journal->disk_->keep_damaged(); !kept) return fail(kept.error());
  if (auto loaded = journal->load(std::move(found).value_or(JournalLoad{}), now); !loaded)
    return fail(loaded.error());
  journal->look_at_clock();
  if (journal->options_.state) journal->model_.apply(*journal->options_.state);
  if (auto written = journal->settle(); !written) return fail(written.error());
  journal->thread_ = start_thread("axisd-journal", [self = journal.get()] { self->run(); });
  return journal;
}

Result<void> JournalFile::load(JournalLoad load, WallTime now) {
  if (load.newer_format)
    return fail(Reason::storage, "the command journal was written by a newer axisd",
                "run that version, or move journal.v1 away 10 minutes after the last command");
  if (load.torn > 0)
    spdlog::warn(
        "the command journal ends in {} bytes of a line that a crash cut short before it was durable: left "
        "out, as nothing was sent for it",
        load.torn);
  model_ = std::move(load.model);
  last_number_ = std::max(load.last_number, options_.last_number);
  look_at_clock();
  model_.forget_before(model_.now() - remembered);
  auto ids = load_ids(*disk_, still_needed(model_.id_files(), model_.now(), options_.bounds));
  if (!ids) return fail(ids.error());
  model_.set_id_files(std::move(ids->files));
  if (load.damage.empty()) load.damage = std::move(ids->damage);
  if (!load.damage.empty() && options_.doubt.empty())
    if (auto kept = disk_->keep_damaged(); !kept) return kept;
  if (load.damage.empty()) load.damage = options_.doubt;
  if (!load.damage.empty())
    model_.apply(DoubtLine{.until = now + longest_validity, .damage = std::move(load.damage)});
  // A clock that was set back meanwhile does not make the doubt longer than it was.
  auto content = model_.content();
  if (content.doubtful_until)
    content.doubtful_until = std::min(*content.doubtful_until, WallTime(now + longest_validity));
  if (content.doubtful_until && *content.doubtful_until <= now) {
    content.doubtful_until.reset();
    model_.doubt_is_over();
  }
  content.ids = std::move(ids->runs);
  loaded_ = std::move(content);
  return {};
}

JournalFile::JournalFile(std::unique_ptr<JournalDisk> disk, Executor core, JournalOptions options)
    : core_(std::move(core)), options_(std::move(options)), disk_(std::move(disk)) {
  of_core_->journal = this;
}

std::string boot_id() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  if (file >> id) return id;
  // Where the system hides it, time goes on within this run of the daemon alone.
  std::random_device random;
  return fmt::format("run-{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

void JournalFile::look_at_clock() {
  model_.apply(model_.time_after(options_.boot, monotonic_now().time_since_epoch()));
}

JournalFile::~JournalFile() {
  of_core_->journal = nullptr;
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock(mutex_);
    closing_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

std::optional<Error> JournalFile::trouble() const {
  if (const auto own = of_core_->trouble.load()) return *own;
  return options_.other_trouble ? options_.other_trouble() : std::nullopt;
}

/// Mostly its `sending` follows before the core does anything else: both are then one write, and wake the
/// thread once.
void JournalFile::accepted(const Command& command, std::string digest) {
  add({.line = AcceptedLine{.command = command, .digest = std::move(digest)}});
  post(core_, [of_core = of_core_] {
    if (of_core->journal != nullptr) of_core->journal->wake_.notify_one();
  });
}

void JournalFile::attached(const std::string& command, RequestKey request, Callback done) {
  enqueue({.line = AttachedLine{.command = command, .request = std::move(request)}, .done = std::move(done)});
}

void JournalFile::sending(const Command& command, SendingNote note, Callback done) {
  enqueue({.line = SendingLine{.command = command, .note = std::move(note)},
           .durable = Durable::at_once,
           .done = std::move(done)});
}

void JournalFile::ended(const Command& command) {
  // Without it a restart asks the drive what became of a motion. It cannot tell so much of these.
  const bool drive_knows_less = command.state == CommandState::unknown || command.kind == CommandKind::home ||
                                command.kind == CommandKind::reset || command.kind == CommandKind::enable;
  enqueue({.line = EndedLine{.command = command},
           .durable = drive_knows_less ? Durable::at_once : Durable::soon});
}

void JournalFile::heard(const Command& command, RequestKey request) {
  enqueue({.line = HeardLine{.command = command, .request = std::move(request)}});
}

Result<void> JournalFile::note(StateLine line) {
  std::promise<Result<void>> told;
  auto answer = told.get_future();
  enqueue({.line = std::move(line), .durable = Durable::at_once, .told = &told});
  return answer.get();
}

void JournalFile::enqueue(Pending pending) {
  add(std::move(pending));
  wake_.notify_one();
}

void JournalFile::add(Pending pending) {
  // Held by the writer only for a swap: the core does not wait for the disk.
  const std::scoped_lock lock(mutex_);
  pending_.push_back(std::move(pending));
}

void JournalFile::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto something = [this] { return closing_ || !pending_.empty(); };
    if (broken_)
      wake_.wait_for(lock, retry, something);
    else if (sync_by_)
      wake_.wait_for(lock, *sync_by_ - monotonic_now(), something);
    else
      wake_.wait(lock, something);
    auto batch = std::exchange(pending_, {});
    const bool last = closing_ && batch.empty();
    lock.unlock();
    if (!batch.empty() || broken_ || sync_by_) commit(std::move(batch));
    if (last) return;
    lock.lock();
  }
}

void JournalFile::commit(std::vector<Pending> batch) {
  look_at_clock();
  for (const auto& pending : batch) model_.apply(pending.line);
  const bool was_broken = broken_;
  // What a failed write left at the end of the file is not known, nor what a failed sync left out.
  const auto written = was_broken ? rewrite() : write(batch);
  broken_ = !written;
  for (auto& pending : batch) {
    if (pending.done) post(core_, [done = std::move(pending.done), written] { done(written); });
    if (pending.told != nullptr) pending.told->set_value(written);
  }
  if (!written) return tell(written.error());
  if (was_broken) tell(std::nullopt);
  if (size_.now < std::max(smallest_rewrite, 2 * size_.when_rewritten)) return;
  if (const auto shortened = settle(); !shortened) {
    broken_ = true;
    tell(shortened.error());
  }
}

/// What has ended goes to the files of ids, apart from the newest; the journal is written anew without it.
Result<void> JournalFile::settle() {
  model_.forget_before(model_.now() - remembered);
  model_.set_id_files(still_needed(model_.id_files(), model_.now(), options_.bounds));
  auto settled = model_.settled(kept_in_full);
  if (!settled.runs.empty()) {
    const auto added = append_ids(*disk_, model_.id_files(), settled.runs);
    if (!added) return fail(added.error());
    model_.apply(*added);
  }
  model_.drop(settled.commands);
  if (auto written = rewrite(); !written) return written;
  std::vector<std::uint32_t> files;
  files.reserve(model_.id_files().size());
  for (const auto& file : model_.id_files()) files.push_back(file.file);
  disk_->keep_ids(files);
  return {};
}

Result<void> JournalFile::write(const std::vector<Pending>& batch) {
  if (auto appended = append(batch); !appended) return appended;
  const auto asks_for = [&batch](Durable durable) {
    return std::ranges::find(batch, durable, &Pending::durable) != batch.end();
  };
  if (!sync_by_ && asks_for(Durable::soon)) sync_by_ = monotonic_now() + options_.sync_within;
  // Nothing new: the time is over, or the journal is closed.
  const bool due = sync_by_ && (batch.empty() || monotonic_now() >= *sync_by_);
  if (!due && !asks_for(Durable::at_once)) return {};
  const auto begun = monotonic_now();
  if (auto synced = disk_->sync(); !synced) return synced;
  {
    const std::lock_guard lock(mutex_);
    sync_times_.add(monotonic_now() - begun);
  }
  all_is_synced();
  return {};
}

LatencyHistogram JournalFile::sync_times() const {
  const std::lock_guard lock(mutex_);
  return sync_times_;
}

Result<void> JournalFile::append(const std::vector<Pending>& batch) {
  if (batch.empty()) return {};
  std::string text;
  if (!told_time_ || model_.now() - *told_time_ >= time_told) {
    told_time_ = model_.now();
    text += numbered(model_.time_after(options_.boot, monotonic_now().time_since_epoch()));
  }
  for (const auto& pending : batch) text += numbered(pending.line);
  if (auto appended = disk_->append(text); !appended) return appended;
  size_.now += text.size();
  return {};
}

std::string JournalFile::numbered(const JournalLine& line) {
  ++last_number_;
  if (!std::holds_alternative<TimeLine>(line) && !std::holds_alternative<StateLine>(line))
    last_fact_ = last_number_;
  return encode_line(last_number_, line);
}

/// A journal that has lost lines since is told by it. It is not synced: a power failure may leave an older
/// one, which convicts nobody.
void JournalFile::mark() {
  const auto pair = model_.state() ? model_.state()->pair : std::string();
  if (const auto marked = disk_->mark(encode_mark({.pair = pair, .line = last_number_})); !marked)
    log_limited(spdlog::level::warn, "store", "journal mark", to_string(marked.error()));
}

void JournalFile::all_is_synced() {
  mark();
  durable_line_ = last_number_;  // first: who sees the fact sees a line that is not before it
  durable_fact_ = last_fact_;
  sync_by_.reset();
}

Result<void> JournalFile::rewrite() {
  std::string text(journal_header);
  for (const auto& line : model_.lines()) text += numbered(line);
  if (auto replaced = disk_->replace(text); !replaced) return replaced;
  all_is_synced();
  size_ = {.now = text.size(), .when_rewritten = text.size()};
  return {};
}

void JournalFile::tell(const std::optional<Error>& trouble) {
  const auto told = trouble ? boost::make_shared<const Error>(*trouble) : nullptr;
  post(core_, [of_core = of_core_, told] { of_core->trouble.store(told); });
}

}  // namespace axisd::store
