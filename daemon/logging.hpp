#pragma once

#include <memory>
#include <string>

#include "daemon/core/bus_recorder.hpp"

namespace spdlog::details {
class thread_pool;
}

namespace axisd {

/// Logging through a thread of its own, so that no caller ever waits for a pipe or a disk: where
/// stderr is the journal to it with priorities and fields (buses/log_about.hpp), else to stderr. Whatever
/// logs must have ended before this does.
class Logging {
 public:
  explicit Logging(const std::string& level);
  Logging(const Logging&) = delete;
  /// Writes what is queued.
  ~Logging();

  /// Appends every frame to `path`, one line each, as append_line() has them (buses/traced_frame.hpp).
  /// Errors: the file cannot be opened.
  [[nodiscard]] Result<core::FrameObserver> open_wire_log(const std::string& path) const;
  /// Ends the process although others still run, who may log until the last moment.
  [[noreturn]] void leave_at_once(int status);

 private:
  std::shared_ptr<spdlog::details::thread_pool> writer_;
};

}  // namespace axisd
