#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "buses/clock.hpp"
#include "buses/task.hpp"
#include "daemon/store/change.hpp"
#include "daemon/store/state_directory.hpp"
#include "daemon/store/state_pair.hpp"
#include "daemon/store/state_witness.hpp"
#include "devices/persistence.hpp"

namespace axisd::store {

struct SaveDelays {
  /// How long the place of an axis that has moved may wait for the next one, where nobody waits for the save.
  /// A restart before it is saved finds the axis elsewhere than at the rest before, and restores no position.
  Duration settled = std::chrono::milliseconds(100);  ///< after the last one
  Duration latest = std::chrono::seconds(1);          ///< after the first one
  /// How long the journal may know more than the state file says of it.
  Duration known = std::chrono::seconds(10);
};

/// Persistent state in one directory, written by a thread of its own: everything that was asked for while the
/// disk was busy goes into the next write together. Where an axis rests is written once for motions that
/// follow each other. Thread: core (created and destroyed there, too).
class FileStore final : public Persistence {
 public:
  /// Goes on with what was found in the directory, and durably counts this start, before anything runs.
  /// Blocks on the disk. Errors: storage, with what to do.
  static Result<std::unique_ptr<FileStore>> begin(StateDirectory directory, Generation found,
                                                  KeptStateSeen seen, Executor core, SaveDelays delays = {});
  /// Saves once more, so that each file knows the other, and begins to serve. Until then nothing is saved.
  /// `witness` outlives this. Errors: as begin().
  Result<void> serve(StateWitness& witness);
  /// Writes what is still pending. Callbacks are posted, which no longer run if the core has ended.
  void close();
  ~FileStore() override { close(); }

  /// Includes this start in start_count.
  [[nodiscard]] const StoredState& loaded() const override { return loaded_; }
  [[nodiscard]] const StoredState& current() const override { return *current_; }
  [[nodiscard]] KeptStateSeen seen() const override { return seen_; }
  /// What the journal is to say of the file as it was last saved. Before serve().
  [[nodiscard]] StateLine line() const { return line_of(durable_); }

  void save_offset(std::string axis, OffsetRecord offset, Callback done) override;
  void forget_offset(std::string axis, Callback done) override;
  void save_inhibit(InhibitRecord inhibit, Callback done) override;
  void save_hold(std::string axis, HoldKey hold, WallTime since, Callback done) override;
  void forget_holds(std::string axis, HoldRecords holds, Callback done) override;
  void count_eeprom_writes(std::string axis, std::uint64_t writes, EepromRecord saves,
                           Callback done) override;
  void accept_state(Callback done) override;

 private:
  struct Pending {
    Change change;
    Callback done;
  };
  FileStore(StateDirectory directory, Generation found, KeptStateSeen seen, Executor core, SaveDelays delays);
  void enqueue(Change change, Callback done);
  void run();
  void wait_for_work(std::unique_lock<std::mutex>& lock);
  /// `mark`: also where nothing has changed.
  void commit(std::vector<Pending> batch, bool mark);
  [[nodiscard]] Result<void> write(const StoredState& state, const StoredState& after_failure);
  [[nodiscard]] Result<void> tell_journal(const Generation& generation);
  [[nodiscard]] bool journal_is_ahead() const;
  void report(Pending pending, const Result<void>& result);

  Executor core_;
  const SaveDelays delays_;
  KeptStateSeen seen_;
  StoredState loaded_;
  std::shared_ptr<StoredState> current_ = std::make_shared<StoredState>();  ///< of the core

  // Of the writing thread, once it runs.
  StateDirectory directory_;
  Generation durable_;         // what the next write starts from
  bool disk_differs_ = false;  // a write failed: the files hold something else than durable_
  StateWitness* witness_ = nullptr;
  TimePoint look_at_{};  // when the journal is next looked at, whether it is ahead

  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Pending> pending_;  // guarded by mutex_
  TimePoint save_at_{};           // guarded by mutex_: when what is pending is written
  TimePoint save_latest_{};       // guarded by mutex_: not later than this, whatever else comes
  TimePoint waits_until_{};  // guarded by mutex_: when the thread wakes by itself; TimePoint{}: it is awake
  bool closing_ = false;     // guarded by mutex_
  std::thread thread_;
};

}  // namespace axisd::store
