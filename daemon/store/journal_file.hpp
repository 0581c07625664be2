#pragma once

#include <atomic>
#include <boost/smart_ptr/atomic_shared_ptr.hpp>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "buses/clock.hpp"
#include "buses/latency_histogram.hpp"
#include "buses/task.hpp"
#include "daemon/store/id_files.hpp"
#include "daemon/store/journal_disk.hpp"
#include "daemon/store/journal_model.hpp"
#include "daemon/store/state_witness.hpp"
#include "devices/axis/command_journal.hpp"

namespace axisd::store {

/// The kernel's name of this start of the computer; empty: there is none.
std::string boot_id();

struct JournalOptions {
  IdBounds bounds{};
  /// Within one start of the computer monotonic_now() tells how long anything takes.
  std::string boot = boot_id();
  /// What it is to say of the state file from its first line on; nothing: what it says already.
  std::optional<StateLine> state{};
  /// Why it does not know all that it should, beside what its lines tell; empty: it does.
  std::string doubt{};
  std::uint64_t last_number = 0;  ///< its lines have higher ones
  /// What need not be durable at once shares a sync with all that comes in this time.
  Duration sync_within = std::chrono::milliseconds(250);
  /// Why nothing new may be started although the journal can be written; empty: nothing else keeps it.
  /// Called by any thread.
  std::function<std::optional<Error>()> other_trouble{};
};

/// The command journal in a file, written by a thread of its own: what is told while the disk is busy goes
/// into the next write together. Thread: core (created and destroyed there, too).
class JournalFile final : public CommandJournal, public StateWitness {
 public:
  /// Durably begins a new journal with what is still needed of the one that was found; nothing: there is none
  /// that can be used. Blocks on the disk. Errors: storage, with what to do.
  static Result<std::unique_ptr<JournalFile>> begin(std::unique_ptr<JournalDisk> disk,
                                                    std::optional<JournalLoad> found, WallTime now,
                                                    Executor core, JournalOptions options = {});
  JournalFile(const JournalFile&) = delete;
  /// Writes what is still pending. Callbacks are posted, which no longer run if the core has ended.
  ~JournalFile() override;

  /// Before it is taken.
  [[nodiscard]] const JournalContent& loaded() const { return loaded_; }
  [[nodiscard]] JournalContent take_loaded() override { return std::move(loaded_); }
  [[nodiscard]] std::optional<Error> trouble() const override;
  void accepted(const Command& command, std::string digest) override;
  void attached(const std::string& command, RequestKey request, Callback done) override;
  void sending(const Command& command, SendingNote note, Callback done) override;
  void ended(const Command& command) override;
  void heard(const Command& command, RequestKey request) override;
  Result<void> note(StateLine line) override;
  [[nodiscard]] std::uint64_t durable_line() const override { return durable_line_; }
  [[nodiscard]] std::uint64_t durable_fact() const override { return durable_fact_; }
  /// How long the disk took to make its lines durable, each time since the start. Thread: any.
  [[nodiscard]] LatencyHistogram sync_times() const;

 private:
  /// When the line is on the disk, where a crash of the computer leaves it. A crash of the daemon alone loses
  /// nothing that was written.
  enum class Durable {
    with_the_next,  ///< that asks for more
    soon,           ///< within JournalOptions::sync_within
    at_once,
  };
  struct Pending {
    JournalLine line;
    Durable durable = Durable::with_the_next;
    Callback done{};
    std::promise<Result<void>>* told = nullptr;  ///< waits for it, on a thread of its own
  };
  /// Of the file, bytes.
  struct Size {
    std::size_t now = 0, when_rewritten = 0;
  };
  JournalFile(std::unique_ptr<JournalDisk> disk, Executor core, JournalOptions options);
  [[nodiscard]] Result<void> load(JournalLoad found, WallTime now);
  void look_at_clock();
  [[nodiscard]] Result<void> settle();
  void enqueue(Pending pending);
  void add(Pending pending);
  void run();
  void commit(std::vector<Pending> batch);
  [[nodiscard]] Result<void> write(const std::vector<Pending>& batch);
  [[nodiscard]] Result<void> append(const std::vector<Pending>& batch);
  [[nodiscard]] std::string numbered(const JournalLine& line);
  void mark();
  void all_is_synced();
  [[nodiscard]] Result<void> rewrite();
  void tell(const std::optional<Error>& trouble);

  Executor core_;
  const JournalOptions options_;
  JournalContent loaded_;
  /// Written by the core, in its turn with the callbacks; outlives this with the handlers that were posted.
  struct OfCore {
    boost::atomic_shared_ptr<const Error> trouble;
    JournalFile* journal = nullptr;  ///< nullptr: it is gone
  };
  std::shared_ptr<OfCore> of_core_ = std::make_shared<OfCore>();

  // Of the writing thread, once it runs.
  std::unique_ptr<JournalDisk> disk_;
  JournalModel model_;
  std::optional<Duration> told_time_;  ///< the last one that was written
  std::uint64_t last_number_ = 0, last_fact_ = 0;
  std::atomic<std::uint64_t> durable_line_ = 0, durable_fact_ = 0;
  Size size_;
  bool broken_ = false;               ///< the last write failed: what the file ends with is not known
  std::optional<TimePoint> sync_by_;  ///< something was written that is durable `soon`

  mutable std::mutex mutex_;
  LatencyHistogram sync_times_;  // guarded by mutex_
  std::condition_variable wake_;
  std::vector<Pending> pending_;  // guarded by mutex_
  bool closing_ = false;          // guarded by mutex_
  std::thread thread_;
};

}  // namespace axisd::store
