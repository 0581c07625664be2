#pragma once

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
  /// Reads the files now. What is not usable is told, and what was served before stays.
  void reload();
  /// Looks no more. Idempotent.
  void close();

 private:
  void run();
  void look();
  void remind();

  const std::shared_ptr<tls::Live> live_;
  const Tell tell_;
  tls::FileWatch watch_;    ///< of the own thread
  tls::Reminder reminder_;  ///< likewise
  TimePoint remind_at_{};   ///< likewise
  std::mutex reloading_;
  std::string complaint_;           ///< under reloading_; why the files are not served; empty: they are
  std::optional<TimePoint> retry_;  ///< under reloading_; when they may be valid by the clock
  std::mutex mutex_;
  std::condition_variable wake_;
  bool closing_ = false;  ///< under mutex_
  std::thread thread_;
};

}  // namespace axisd
