// What is served from the files of `server.tls`, which may be replaced while connections are open.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>

#include "api/tls/clients.hpp"
#include "api/tls/pem_files.hpp"
#include "api/tls/session.hpp"
#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd::tls {

/// What was read at one time: all of it belongs together. Thread: any.
struct Generation {
  std::uint64_t number;  ///< of another one: another
  Files contents;
  std::shared_ptr<const Acceptor> acceptor;
  Clients clients;
};

/// The newest files that were good. All doors of the daemon look at the same ones: new connections get what
/// is served then, and calls on open ones are judged by it. Thread: any.
class Live {
 public:
  /// Reads the files. Errors: as read().
  [[nodiscard]] static Result<std::shared_ptr<Live>> open(Files paths,
                                                          WallTime now = std::chrono::system_clock::now());

  [[nodiscard]] const Files& paths() const { return paths_; }
  [[nodiscard]] std::shared_ptr<const Generation> served() const;

  /// Reads the files again. True: they hold something else than before, which is served from now on. Blocks
  /// for the disk. Errors: as read(); what was served stays.
  [[nodiscard]] Result<bool> reload(WallTime now = std::chrono::system_clock::now());

 private:
  explicit Live(Files paths) : paths_(std::move(paths)) {}

  const Files paths_;
  std::mutex reloading_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Generation> served_;  ///< under mutex_
};

}  // namespace axisd::tls
