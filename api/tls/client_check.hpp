// Why a client gets no TLS connection, in words: gRPC says no more than that it could not connect.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd::tls {

/// What a client connects with, as texts in PEM format. Errors call them --tls-ca, --tls-cert and --tls-key.
struct ClientFiles {
  std::string ca;                ///< authorities of the daemon
  std::string certificate, key;  ///< both or none
};

/// What a daemon shows in a handshake.
struct Shown {
  std::string certificates;           ///< its own first; empty: it does not speak TLS
  bool asks = false;                  ///< for a certificate of the client
  std::vector<std::string> accepted;  ///< names of the authorities of clients; empty: it does not say
};

/// What is wrong with a client's own certificate, whoever it connects to. Errors: invalid_argument.
[[nodiscard]] std::optional<Error> wrong_with(const ClientFiles& files, WallTime now);
/// Why a handshake fails with a daemon that shows this, called by the name or address `host`. Nothing: not
/// for any of the usual reasons. Errors: unauthenticated.
[[nodiscard]] std::optional<Error> why_refused(const ClientFiles& files, const Shown& shown,
                                               const std::string& host, WallTime now);

/// Makes a handshake and ends the connection. Nothing: nobody answers there in time. Blocks for `patience` at
/// most, and for the resolution of the name.
[[nodiscard]] std::optional<Shown> look_at(const std::string& host, const std::string& port,
                                           Duration patience);

}  // namespace axisd::tls
