// Who calls.
#pragma once

#include <grpcpp/server_context.h>

#include <optional>
#include <string>
#include <string_view>

#include "buses/clock.hpp"

namespace axisd::server {

/// The client's identity: the common name (else the first alternative name, else a hash) of its verified
/// certificate; without TLS, "local:" and the host part of its address. Never the port: request ids must stay
/// valid over a reconnection.
[[nodiscard]] std::string client_of(const grpc::CallbackServerContext& context);

/// An identity as it may appear in the log and in Command.client: of a bounded length, without anything by
/// which a certificate could forge a line there.
[[nodiscard]] std::string printable_identity(std::string_view name);

/// Of a verified certificate without any name; `pem`: that certificate. Not its address, of which a client
/// may have many: what one may take of the daemon is counted by this (M32).
[[nodiscard]] std::string unnamed_identity(std::string_view pem);

/// How long the caller waits for the answer, from this call on, by the clock of its deadline; nothing: for
/// ever. Not above a day.
[[nodiscard]] std::optional<Duration> patience_of(const grpc::CallbackServerContext& context);

/// "ipv4:127.0.0.1:50312" to "127.0.0.1", "ipv6:%5B::1%5D:50312" to "::1", "unix:..." to "unix".
[[nodiscard]] std::string peer_host(const std::string& peer);

}  // namespace axisd::server
