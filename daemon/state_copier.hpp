#pragma once

#include <filesystem>

#include "daemon/bounded_worker.hpp"
#include "devices/state_copy.hpp"

namespace axisd {

/// Copies the state file of a directory on a thread of its own. Thread: any.
class StateCopier final : public StateCopies {
 public:
  explicit StateCopier(std::filesystem::path directory);
  void copy_state(std::function<void(Result<StateCopy>)> callback) override;

 private:
  const std::filesystem::path directory_;
  BoundedWorker worker_;
};

/// Puts the backup in `file` in the place of what is in `directory`, and says what to do next. Exit status.
int restore_state(const std::string& file, const std::filesystem::path& directory);

}  // namespace axisd
