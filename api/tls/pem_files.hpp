// The PEM files of `server.tls`: what the server presents, and whom it accepts. Without gRPC, for the offline
// check.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd::tls {

struct Files {
  std::string certificate;  ///< the server's chain, its own certificate first
  std::string key;          ///< private key of that certificate, not encrypted
  std::string client_ca;    ///< authorities that clients' certificates are verified against
  std::string crl{};        ///< what these authorities have revoked; empty: nothing

  friend bool operator==(const Files&, const Files&) = default;
};

/// Under which key of `server.tls` a file is named, and what is wrong with it, with its path: configuring
/// where a file is not valid yet by this computer's clock, else invalid_argument.
using Findings = std::vector<std::pair<std::string_view, Error>>;

/// Reads all files and looks at them completely: missing, unreadable, not PEM, not valid at `now`, a key of
/// another certificate or open to every user, a revocation list of another authority or out of date. Empty:
/// nothing is wrong. Blocks for the disk.
[[nodiscard]] Findings check(const Files& files, WallTime now = std::chrono::system_clock::now());

/// The contents of all files. Errors: the first of check().
[[nodiscard]] Result<Files> read(const Files& files, WallTime now = std::chrono::system_clock::now());

}  // namespace axisd::tls
