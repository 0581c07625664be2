// A program under test as a process.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"

namespace axisd::conformance {

/// Runs from its construction on; what it prints goes to one file. The destructor ends it.
class Process {
 public:
  /// `arguments` begin with the program. Throws std::runtime_error: it cannot be started.
  Process(const std::vector<std::string>& arguments, std::string output);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Exit status (128 + number after a signal), once it has ended.
  [[nodiscard]] std::optional<int> status();
  /// SIGTERM; the exit status. Killed if it has not ended after `limit`: nothing.
  std::optional<int> end(Duration limit);
  /// All that it has printed.
  [[nodiscard]] std::string output() const;

 private:
  pid_t pid_;
  std::string output_;
  std::optional<int> status_;
};

/// Asks again and again until `condition`. False: not within `limit`.
template <class Condition>
bool wait_until(Condition condition, Duration limit) {
  const auto end = monotonic_now() + limit;
  while (!condition()) {
    if (monotonic_now() > end) return false;
    block_until(monotonic_now() + std::chrono::milliseconds(10));
  }
  return true;
}

}  // namespace axisd::conformance
