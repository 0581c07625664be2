// The certificates of the entrance, as a server and as a client, which may be replaced while it runs.
#pragma once

#include <spdlog/common.h>

#include <memory>
#include <string>
#include <vector>

#include "api/cell/cell.hpp"
#include "api/cell/settings.hpp"
#include "api/tls/expiry.hpp"
#include "api/tls/file_watch.hpp"
#include "api/tls/live.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// Thread: core; files are read on the disk's.
class Certificates {
 public:
  /// Blocks for the disk. `settings` outlives this. Errors: invalid_argument (files that cannot be used).
  [[nodiscard]] static Result<Certificates> read(const Settings& settings);

  [[nodiscard]] const Trust& trust() const { return trust_; }
  /// nullptr: the entrance has no TLS.
  [[nodiscard]] std::shared_ptr<const tls::Live> live() const { return live_; }
  /// What has expired, a line each: others do not let this entrance in, or are not let in.
  [[nodiscard]] std::vector<std::string> expired(WallTime now) const;
  /// When what is used now ends, by its key in the configuration.
  [[nodiscard]] const std::vector<tls::Expiry>& expiries() const { return expiries_; }
  /// From now on files that were replaced are read again. What is not usable is told, and what was served
  /// stays; what ends soon, or has ended, is told every day. Once; this is not moved any more, and outlives
  /// neither of them.
  void keep(Clock& clock, Cell& cell);

 private:
  Certificates(const Settings& settings, std::shared_ptr<tls::Live> live, Trust trust);
  [[nodiscard]] static Result<Trust> trust_of(const Settings& settings);
  void look();
  void remind();
  /// In the log, and as an event.
  void tell(spdlog::level::level_enum level, std::string text);

  const Settings* settings_;
  std::shared_ptr<tls::Live> live_;
  Trust trust_;
  std::shared_ptr<tls::FileWatch> watch_;
  std::vector<tls::Expiry> expiries_;  ///< of what is used
  tls::Reminder reminder_;
  Clock* clock_ = nullptr;
  Cell* cell_ = nullptr;
  Clock::Timer timer_;
};

}  // namespace axisd::cell
