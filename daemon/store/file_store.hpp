#pragma once

#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "buses/task.hpp"
#include "daemon/store/change.hpp"
#include "daemon/store/state_directory.hpp"
#include "devices/persistence.hpp"

namespace axisd::store {

/// Persistent state in one directory, written by a thread of its own: everything that was asked for while the
/// disk was busy goes into the next write together. Thread: core (created and destroyed there, too).
class FileStore final : public Persistence {
 public:
  /// Locks the directory, loads it and durably counts this start, before anything runs. Blocks on the disk.
  /// Errors: storage, with what to do.
  static Result<std::unique_ptr<FileStore>> open(const std::filesystem::path& directory, Executor core);
  /// Writes what is still pending. Callbacks are posted, which no longer run if the core has ended.
  ~FileStore() override;

  /// Includes this start in start_count.
  [[nodiscard]] const StoredState& loaded() const override { return loaded_; }
  [[nodiscard]] const StoredState& current() const override { return *current_; }
  /// Set if the newest file was damaged and an older one is used, without its offsets and with motion
  /// inhibited.
  [[nodiscard]] const std::optional<Error>& damage() const { return damage_; }

  void save_offset(std::string axis, OffsetRecord offset, Callback done) override;
  void forget_offset(std::string axis, Callback done) override;
  void save_inhibit(InhibitRecord inhibit, Callback done) override;
  void save_hold(std::string axis, HoldKey hold, WallTime since, Callback done) override;
  void forget_holds(std::string axis, HoldRecords holds, Callback done) override;
  void count_eeprom_writes(std::string axis, std::uint64_t writes, EepromRecord saves,
                           Callback done) override;

 private:
  struct Pending {
    Change change;
    Callback done;
  };
  FileStore(StateDirectory directory, Generation loaded, std::optional<Error> damage, Executor core);
  Result<void> count_this_start();
  void enqueue(Change change, Callback done);
  void run();
  void commit(std::vector<Pending> batch);
  Result<void> write(const StoredState& state);
  void report(Pending pending, const Result<void>& result);

  Executor core_;
  std::optional<Error> damage_;
  StoredState loaded_;
  std::shared_ptr<StoredState> current_ = std::make_shared<StoredState>();  ///< of the core

  // Of the writing thread, once it runs.
  StateDirectory directory_;
  Generation durable_;         // what the next write starts from
  bool disk_differs_ = false;  // a write failed: the disk holds something else than durable_

  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Pending> pending_;  // guarded by mutex_
  bool closing_ = false;          // guarded by mutex_
  std::thread thread_;
};

}  // namespace axisd::store
