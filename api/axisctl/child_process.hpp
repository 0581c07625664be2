// A program that runs beside this one, with Ctrl-C and SIGTERM going to it.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace axisd::axisctl {

/// While it lives SIGINT and SIGTERM do not end this program: the terminal sends the one to the
/// child by itself, the other is passed on. Threads that are made later take that over, so it comes before
/// them.
class ChildProcess {
 public:
  ChildProcess();
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Runs words[0], found by PATH, with these variables beside the environment. Throws Failure (usage) if it
  /// cannot be run.
  void start(const std::vector<std::string>& words,
             const std::vector<std::pair<std::string, std::string>>& variables);
  /// Its exit status, 128 + N if signal N ended it; nothing: it still runs after `limit`.
  std::optional<int> wait_for(std::chrono::milliseconds limit);

 private:
  int signals_ = -1;  ///< signalfd
  int ended_ = -1;    ///< pidfd
  pid_t pid_ = -1;
};

}  // namespace axisd::axisctl
