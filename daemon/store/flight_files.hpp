#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "buses/task.hpp"
#include "daemon/store/record_files.hpp"

namespace axisd::store {

/// Flight records in a directory, written and read by a thread of its own. Thread: core (created and
/// destroyed there, too).
class FlightFiles final : public RecordFiles {
 public:
  /// Keeps the newest `keep` records. The directory is made with the first one. Callbacks are posted to
  /// `core`.
  FlightFiles(std::filesystem::path directory, std::size_t keep, Executor core);
  FlightFiles(const FlightFiles&) = delete;
  /// Does what is still asked for.
  ~FlightFiles() override;

  void write(std::string name, Render render, std::function<void(Result<void>)> done) override;
  void list(std::function<void(Result<std::vector<FlightRecord>>)> done) override;
  void read(std::string name, std::function<void(Result<std::string>)> done) override;

 private:
  template <class T, class Work>
  void enqueue(Work work, std::function<void(Result<T>)> done);
  void run();
  [[nodiscard]] Result<void> save(const std::string& name, const std::string& text) const;
  [[nodiscard]] Result<std::vector<FlightRecord>> found() const;
  [[nodiscard]] Result<std::string> load(const std::string& name) const;
  void remove_oldest() const;

  const std::filesystem::path directory_;
  const std::size_t keep_;
  const Executor core_;

  std::mutex mutex_;  ///< held for moves only: the core does not wait for the disk
  std::condition_variable wake_;
  std::deque<std::function<void()>> jobs_;  // guarded by mutex_
  bool closing_ = false;                    // guarded by mutex_
  std::thread thread_;
};

}  // namespace axisd::store
