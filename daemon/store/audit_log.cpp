#include "daemon/store/audit_log.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <unordered_map>
#include <utility>
#include <variant>

#include "buses/log_about.hpp"
#include "daemon/store/thread.hpp"

namespace axisd::store {
namespace {

/// A disk that failed is tried again so often.
constexpr auto retry = std::chrono::seconds(1);
/// Written together.
constexpr std::size_t most_at_once = 256;
/// Bytes in which the last command that was told is looked for.
constexpr std::uint64_t looked_at = 16U << 20U;

AuditEntry now(AuditContent content) {
  return {.at = std::chrono::system_clock::now(),
          .uptime = monotonic_now().time_since_epoch(),
          .content = std::move(content)};
}

/// Commands that lines tell of; true: of their end, too.
using Told = std::unordered_map<std::string, bool>;

/// Of commands in order of acceptance those that lines should tell of and do not. What was never told comes
/// behind all that was; what comes before and is not among the lines any more, was, in files that are gone.
std::vector<RecoveredCommand> missing(std::vector<RecoveredCommand> earlier, const Told& told) {
  std::vector<RecoveredCommand> found;
  const auto is_told = [&told](const RecoveredCommand& each) { return told.contains(each.command.id); };
  const auto untold = std::find_if(earlier.rbegin(), earlier.rend(), is_told).base();
  for (auto each = earlier.begin(); each != untold; ++each) {
    const auto known = told.find(each->command.id);
    if (known != told.end() && !known->second && ended(each->command.state))
      found.push_back(std::move(*each));
  }
  std::move(untold, earlier.end(), std::back_inserter(found));
  return found;
}

/// A command was accepted, or ended as it should. With an id of its request the command journal tells it,
/// too.
bool may_be_gathered(const AuditEntry& entry) {
  const auto* event = std::get_if<Event>(&entry.content);
  const auto* change = event == nullptr ? nullptr : std::get_if<CommandChange>(&event->content);
  return change != nullptr && !change->command->request_id.empty() && !change->command->cause;
}

}  // namespace

std::vector<RecoveredCommand> recovered(const JournalContent& content) {
  std::vector<RecoveredCommand> commands;
  commands.reserve(content.commands.size());
  for (const auto& journalled : content.commands)
    commands.push_back({.command = journalled.command, .sent = journalled.sent});
  return commands;
}

AuditLog::AuditLog(AuditOptions options)
    : options_(std::move(options)), files_(options_.directory, options_.bounds) {
  thread_ = start_thread("axisd-audit", [this] { run(); });
}

AuditLog::~AuditLog() {
  {
    const std::scoped_lock lock(mutex_);
    closing_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void AuditLog::add(AuditEntry entry) {
  bool wakes = false;
  {
    const std::scoped_lock lock(mutex_);
    if (waiting_count_ >= options_.most_waiting) {
      ++left_out_;
      return;
    }
    ++waiting_count_;
    const bool hurries = !may_be_gathered(entry);
    // Else the thread was woken before, and has not come yet, or gathers.
    wakes = added_.empty() || (hurries && !in_a_hurry_);
    in_a_hurry_ = in_a_hurry_ || hurries;
    added_.push_back(std::move(entry));
  }
  if (wakes) wake_.notify_one();
}

void AuditLog::write_all() {
  std::unique_lock lock(mutex_);
  if (added_.empty() && taken_ == ended_) return;
  // What was added before is part of the next take at the latest.
  const auto awaited = added_.empty() ? taken_ : taken_ + 1;
  in_a_hurry_ = in_a_hurry_ || !added_.empty();
  wake_.notify_one();
  written_.wait(lock, [&] { return ended_ >= awaited || trouble_; });
}

std::optional<Error> AuditLog::trouble() const {
  const std::scoped_lock lock(mutex_);
  if (trouble_ || left_out_ == 0) return trouble_;
  return Error{.reason = Reason::storage,
               .message = "the disk takes the records of the audit too slowly",
               .remedy = "check the disk of the state directory"};
}

void AuditLog::run() {
  tell(open());
  written_.notify_all();
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto something = [this] { return closing_ || !added_.empty(); };
    if (trouble_)
      wake_.wait_for(lock, retry, [this] { return closing_; });
    else if (sync_by_)
      wake_.wait_for(lock, *sync_by_ - monotonic_now(), something);
    else
      wake_.wait(lock, something);
    if (!added_.empty() && !in_a_hurry_)
      wake_.wait_for(lock, options_.gather_within, [this] { return closing_ || in_a_hurry_; });
    const bool last = closing_;
    auto added = std::exchange(added_, {});
    in_a_hurry_ = false;
    ++taken_;
    lock.unlock();
    std::ranges::move(added, std::back_inserter(waiting_));
    tell(open_ ? write() : open());
    lock.lock();
    ended_ = taken_;
    written_.notify_all();
    if (last && (added_.empty() || trouble_)) break;
  }
  if (sync_by_) (void)files_.sync();
}

/// What an earlier run of the daemon could not write any more goes first.
Result<void> AuditLog::open() {
  if (auto opened = files_.open(); !opened) return opened;
  Told told;
  if (!options_.earlier.empty()) {
    const auto shown = files_.show_newest(looked_at, [&](std::string_view line) {
      if (auto command = options_.format.command_of(line)) told[command->id] |= command->ended;
    });
    if (!shown) return shown;
  }
  std::vector<AuditEntry> first;
  for (auto& earlier : missing(std::exchange(options_.earlier, {}), told))
    first.push_back(now(std::move(earlier)));
  {
    const std::scoped_lock lock(mutex_);
    waiting_count_ += first.size();
  }
  waiting_.insert(waiting_.begin(), std::make_move_iterator(first.begin()),
                  std::make_move_iterator(first.end()));
  newest_ = files_.newest();
  open_ = true;
  return write();
}

Result<void> AuditLog::write() {
  for (;;) {
    if (text_.empty()) encode_some();
    if (text_.empty()) return sync_if_due();
    if (auto written = files_.append(text_, lines_); !written) return written;
    newest_ = files_.newest();
    text_.clear();
    lines_ = 0;
    if (!sync_by_) sync_by_ = monotonic_now() + options_.sync_within;
    if (auto synced = sync_if_due(); !synced) return synced;
  }
}

Result<void> AuditLog::sync_if_due() {
  if (!sync_by_ || monotonic_now() < *sync_by_) return {};
  if (auto synced = files_.sync(); !synced) return synced;
  sync_by_.reset();
  return {};
}

void AuditLog::encode_some() {
  std::uint64_t left_out = 0;
  const auto count = std::min(waiting_.size(), most_at_once);
  for (std::size_t i = 0; i < count; ++i) {
    encode(waiting_.front());
    waiting_.pop_front();
  }
  {
    const std::scoped_lock lock(mutex_);
    waiting_count_ -= count;
    if (waiting_.empty() && added_.empty()) left_out = std::exchange(left_out_, 0);
  }
  if (left_out > 0) encode(now(AuditGap{.left_out = left_out}));
}

void AuditLog::encode(const AuditEntry& entry) {
  if (const auto* event = std::get_if<Event>(&entry.content))
    if (const auto* reloaded = std::get_if<ConfigurationReloaded>(&event->content))
      options_.revision = reloaded->revision;
  ++lines_;
  text_ += options_.format.encode({.number = files_.newest() + lines_,
                                   .instance_id = options_.instance_id,
                                   .revision = options_.revision},
                                  entry);
  text_ += '\n';
}

void AuditLog::tell(const Result<void>& written) {
  const auto message = written ? std::string() : to_string(written.error());
  {
    const std::scoped_lock lock(mutex_);
    const auto before = trouble_ ? to_string(*trouble_) : std::string();
    trouble_.reset();
    if (!written) trouble_ = written.error();
    if (message == before) return;
  }
  if (message.empty())
    log_about(spdlog::level::info, LogKind::storage_works, {}, "the audit can be written again");
  else
    log_about(spdlog::level::err, LogKind::storage_failed, {},
              fmt::format("the audit: {}; motion is refused until it can be written", message));
}

}  // namespace axisd::store
