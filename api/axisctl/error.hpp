// How axisctl ends: exit codes, and one line of text for everything that can go wrong.
#pragma once

#include <grpcpp/support/status.h>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "axisd/v1/error.pb.h"

namespace axisd::axisctl {

/// Documented in --help; scripts depend on the numbers.
enum class ExitCode : int {
  ok = 0,
  ended_otherwise = 1,  ///< a motion ended, but not Done
  usage = 2,            ///< bad arguments or a bad configuration file
  unreachable = 3,      ///< the daemon did not answer
  refused = 4,          ///< the daemon answered with an error
  interrupted = 130,    ///< Ctrl-C while waiting, as shells number SIGINT
};

/// Ends the program with a line "axisctl: TEXT", or error_json(), on standard error. Thrown, because every
/// command ends at its first failure and CLI11 reports by exception as well.
class Failure : public std::runtime_error {
 public:
  Failure(ExitCode code, const std::string& text, bool nothing_sent = false)
      : std::runtime_error(text), code_(code), nothing_sent_(nothing_sent) {}
  /// With what the daemon said.
  Failure(ExitCode code, const std::string& text, v1::ErrorDetail detail, bool nothing_sent = false)
      : std::runtime_error(text), code_(code), nothing_sent_(nothing_sent), detail_(std::move(detail)) {}
  /// The same failure in other words.
  [[nodiscard]] Failure saying(const std::string& text) const;
  [[nodiscard]] ExitCode code() const { return code_; }
  /// `unreachable` only: there was no connection to send it on, so that it cannot have arrived.
  [[nodiscard]] bool nothing_sent() const { return nothing_sent_; }
  /// What the daemon said; nothing: the failure is this program's own.
  [[nodiscard]] const std::optional<v1::ErrorDetail>& detail() const { return detail_; }

 private:
  ExitCode code_;
  bool nothing_sent_ = false;
  std::optional<v1::ErrorDetail> detail_;
};

/// One line of JSON, {"error": {...}}: the fields of ErrorDetail as far as they are known, `exit_status`, and
/// `text`, the line that people get. `reason` is the daemon's, else USAGE, UNREACHABLE, REFUSED, INTERRUPTED
/// or FAILED.
std::string error_json(const Failure& failure);
/// Tells of a failure on standard error: as a line of text, or of JSON.
void complain(const Failure& failure, bool as_json);

/// The typed detail of the grpc-status-details-bin trailer, if the daemon sent one.
std::optional<v1::ErrorDetail> detail_of(const grpc::Status& status);

/// One line: address, message, permitted range, remedy, in words of axisctl. A message that begins with
/// `subject` loses that: the caller names it already.
std::string describe(const v1::ErrorDetail& detail, std::string_view subject = {});

/// Who was connected to.
enum class Asked : std::uint8_t { daemon, entrance };

/// What to tell about a call that failed. `subject` (an axis, a command id or empty) leads the line; `server`
/// names the endpoint for a daemon that cannot be reached; `tls` says whether the connection was encrypted.
Failure failure_of(const grpc::Status& status, std::string_view subject, std::string_view server, bool tls,
                   Asked asked = Asked::daemon);

}  // namespace axisd::axisctl
