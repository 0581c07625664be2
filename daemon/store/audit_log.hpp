#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "buses/clock.hpp"
#include "daemon/store/audit_files.hpp"
#include "devices/audit.hpp"
#include "devices/axis/command_journal.hpp"

namespace axisd::store {

/// What each record says beside its entry.
struct AuditHead {
  std::uint64_t number = 0;
  std::string instance_id;
  std::string revision;  ///< of the configuration that is served
};

/// How entries become lines: what a line looks like is not this folder's business.
struct AuditFormat {
  /// One line, without its end.
  std::function<std::string(const AuditHead&, const AuditEntry&)> encode;
  /// A command that a line tells of, if it is one of a command that was accepted.
  struct Told {
    std::string id;
    bool ended = false;
  };
  std::function<std::optional<Told>(std::string_view line)> command_of;
};

struct AuditOptions {
  std::filesystem::path directory;
  AuditBounds bounds{};
  AuditFormat format;
  std::string instance_id, revision;
  /// What the command journal knows of earlier runs: those that no line tells of get one, before anything
  /// else.
  std::vector<RecoveredCommand> earlier{};
  /// What is written need not be durable sooner: commands that start something are in the journal before
  /// that.
  Duration sync_within = std::chrono::seconds(1);
  /// What the command journal tells, too, is written with others that come within that time. Each write costs
  /// a wake of the thread.
  Duration gather_within = std::chrono::milliseconds(100);
  std::size_t most_waiting = 20'000;  ///< entries that the disk has not taken yet
};

/// What the command journal tells of earlier runs.
[[nodiscard]] std::vector<RecoveredCommand> recovered(const JournalContent& content);

/// The audit, written by a thread of its own: at once, but for what a start of the daemon would recover from
/// the command journal, and made durable in batches. Thread: any (created and destroyed by one).
class AuditLog final : public AuditSink {
 public:
  explicit AuditLog(AuditOptions options);
  AuditLog(const AuditLog&) = delete;
  /// Writes what waits, if the disk takes it.
  ~AuditLog() override;

  void add(AuditEntry entry) override;
  /// Blocks until all that was added is written, or the disk does not take it. Thread: any but the core.
  void write_all();
  /// Why nothing can be written at present; nothing: all is well.
  [[nodiscard]] std::optional<Error> trouble() const;
  /// Number of the last record that was written; 0: there is none.
  [[nodiscard]] std::uint64_t newest() const { return newest_; }

 private:
  void run();
  [[nodiscard]] Result<void> open();
  [[nodiscard]] Result<void> write();
  [[nodiscard]] Result<void> sync_if_due();
  void encode_some();
  void encode(const AuditEntry& entry);
  void tell(const Result<void>& written);

  AuditOptions options_;

  // Of the writing thread.
  AuditFiles files_;
  bool open_ = false;               ///< AuditFiles::open() has been successful
  std::deque<AuditEntry> waiting_;  ///< not yet encoded
  std::string text_;                ///< encoded, not yet written
  std::uint64_t lines_ = 0;         ///< in `text_`
  std::optional<TimePoint> sync_by_;

  std::atomic<std::uint64_t> newest_ = 0;
  mutable std::mutex mutex_;  ///< held for a move only: the core waits for it
  std::condition_variable wake_, written_;
  std::deque<AuditEntry> added_;   // guarded by mutex_
  bool in_a_hurry_ = false;        // guarded by mutex_: what was added waits for nothing more
  std::uint64_t taken_ = 0;        // guarded by mutex_: so often the thread has taken what was added, and
  std::uint64_t ended_ = 0;        // guarded by mutex_: written it, or tried to
  std::size_t waiting_count_ = 0;  // guarded by mutex_: added_ and waiting_
  std::uint64_t left_out_ = 0;     // guarded by mutex_
  std::optional<Error> trouble_;   // guarded by mutex_
  bool closing_ = false;           // guarded by mutex_
  std::thread thread_;
};

}  // namespace axisd::store
