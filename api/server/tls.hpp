// Credentials from PEM files.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "buses/error.hpp"

namespace axisd::server {

/// Paths of PEM files.
struct TlsFiles {
  std::string certificate;  ///< the server's chain, its own certificate first
  std::string key;          ///< private key of that certificate, not encrypted
  std::string client_ca;    ///< authorities that clients' certificates are verified against
};

/// Mutual TLS: clients must show a certificate that verifies. The files are checked completely before,
/// because gRPC itself accepts unusable ones and then fails every handshake. Errors: invalid_argument, naming
/// the file.
[[nodiscard]] Result<std::shared_ptr<grpc::ServerCredentials>> tls_credentials(const TlsFiles& files);

}  // namespace axisd::server
