// Ctrl-C as a request instead of the end of the program.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

namespace axisd::axisctl {

/// While it lives, the first SIGINT, SIGTERM or SIGHUP calls `action`, on a thread of its own; a second one
/// ends the program as usual. At most one inside another (a command within a script); a signal is a request
/// to both.
class Interrupt {
 public:
  explicit Interrupt(std::function<void()> action);
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  ~Interrupt();

  [[nodiscard]] bool requested() const;
  /// Waits until the request or for `limit`, whichever comes first. Returns requested().
  [[nodiscard]] bool wait_for(std::chrono::milliseconds limit) const;

 private:
  int request_ = -1;  ///< eventfd that the signal makes readable
  int closing_ = -1;  ///< eventfd that ends the thread
  std::function<void()> action_;
  std::thread thread_;
};

}  // namespace axisd::axisctl
