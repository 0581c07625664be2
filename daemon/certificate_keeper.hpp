#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "api/tls/expiry.hpp"
#include "api/tls/file_watch.hpp"
#include "api/tls/live.hpp"
#include "buses/clock.hpp"
#include "devices/event.hpp"

namespace axisd {

/// Keeps the certificates that are served as the files are: reads them again when they were replaced, and
/// tells of those that end. On a thread of its own, because it waits for the disk. Thread: any.
class CertificateKeeper {
 public:
  using Tell = std::function<void(CertificateNotice)>;

  /// `live`: nullptr: there is nothing to keep. `tell`: on any thread.
  CertificateKeeper(std::shared_ptr<tls::Live> live, Tell tell);
  /// As close().
  ~CertificateKeeper();
  CertificateKeeper(const CertificateKeeper&) = delete;

  /// Begins to look, about every second. Once.
  void start();
  /// One look, by the clock of the certificates and by one that does not jump: reads files that were replaced
  /// or are due to be tried again, and reminds. Precondition: there is something to keep; one at a time, so
  /// not after start().
  void look(WallTime wall, TimePoint now);
  /// Reads the files now. What is not usable is told, once, and tried again after a minute; what was served
  /// before stays.
  void reload(WallTime wall = std::chrono::system_clock::now(), TimePoint now = monotonic_now());
  /// Looks no more. Idempotent.
  void close();

 private:
  void run();
  void remind(WallTime wall, TimePoint now);

  const std::shared_ptr<tls::Live> live_;
  const Tell tell_;
  tls::FileWatch watch_;    ///< of the own thread
  tls::Reminder reminder_;  ///< likewise
  TimePoint remind_at_{};   ///< likewise
  std::mutex reloading_;
  std::string complaint_;  ///< under reloading_; what keeps the files from it; empty: they are served
  std::optional<TimePoint> retry_;  ///< under reloading_; when they may be valid by the clock
  std::mutex mutex_;
  std::condition_variable wake_;
  bool closing_ = false;  ///< under mutex_
  std::thread thread_;
};

}  // namespace axisd
