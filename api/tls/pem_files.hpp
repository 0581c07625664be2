// The PEM files of `server.tls`: what the server presents, and whom it accepts. Without gRPC, for the offline
// check.
#pragma once

#include <chrono>
#include <cstdint>
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
/// where it is out of its time by this computer's clock, else invalid_argument. The time itself is in the
/// remedy only: the same finding has the same message.
using Findings = std::vector<std::pair<std::string_view, Error>>;

/// What files are wanted for: the less, the fewer findings.
enum class Demand : std::uint8_t {
  good,    ///< nothing is wrong with them
  usable,  ///< they can be served: a revocation list that is out of its time goes on to revoke what it names
  usable_some_time,  ///< they can be served once the clock is right: whatever is out of its time may be
};

/// Reads all files and looks at them completely: missing, unreadable, not PEM, not valid at `now`, a key of
/// another certificate or open to every user, a revocation list of another authority or out of date. Empty:
/// they are what is wanted. Blocks for the disk.
[[nodiscard]] Findings check(const Files& files, WallTime now = std::chrono::system_clock::now(),
                             Demand demand = Demand::good);

/// The contents of all files. Errors: the first of check() for Demand::usable.
[[nodiscard]] Result<Files> read(const Files& files, WallTime now = std::chrono::system_clock::now());

}  // namespace axisd::tls
