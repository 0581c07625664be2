// The PEM files of `server.tls`: what the server presents, and whom it accepts. Without gRPC, for the offline
// check.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "buses/error.hpp"

namespace axisd::tls {

struct Files {
  std::string certificate;  ///< the server's chain, its own certificate first
  std::string key;          ///< private key of that certificate, not encrypted
  std::string client_ca;    ///< authorities that clients' certificates are verified against
};

/// Under which key of `server.tls` a file is named, and what is wrong with it: invalid_argument, with its
/// path.
using Findings = std::vector<std::pair<std::string_view, Error>>;

/// Reads all files and looks at them completely: missing, unreadable, not PEM, expired, a key of another
/// certificate. Empty: nothing is wrong. A certificate that is not valid yet is none: a computer without a
/// battery for its clock starts in the past. Blocks for the disk.
[[nodiscard]] Findings check(const Files& files);

/// The contents of all files. Errors: the first of check().
[[nodiscard]] Result<Files> read(const Files& files);

}  // namespace axisd::tls
