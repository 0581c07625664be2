// Credentials from PEM files.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "api/tls/live.hpp"

namespace axisd::transport {

/// Mutual TLS: clients must show a certificate that verifies. Each handshake gets what `live` serves at that
/// time; connections that are there stay. For one port, or one acceptor of connections.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> tls_credentials(std::shared_ptr<const tls::Live> live);

}  // namespace axisd::transport
