// Credentials from PEM files.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "api/tls/pem_files.hpp"
#include "buses/error.hpp"

namespace axisd::server {

using TlsFiles = tls::Files;

/// Mutual TLS: clients must show a certificate that verifies. The files are checked completely before,
/// because gRPC itself accepts unusable ones and then fails every handshake. Errors: invalid_argument, naming
/// the file.
[[nodiscard]] Result<std::shared_ptr<grpc::ServerCredentials>> tls_credentials(const TlsFiles& files);

}  // namespace axisd::server
