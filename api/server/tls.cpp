#include "api/server/tls.hpp"

#include <utility>

namespace axisd::server {

Result<std::shared_ptr<grpc::ServerCredentials>> tls_credentials(const TlsFiles& files) {
  auto contents = tls::read(files);
  if (!contents) return fail(std::move(contents).error());
  grpc::SslServerCredentialsOptions options(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  options.pem_root_certs = std::move(contents->client_ca);
  options.pem_key_cert_pairs.push_back(
      {.private_key = std::move(contents->key), .cert_chain = std::move(contents->certificate)});
  return grpc::SslServerCredentials(options);
}

}  // namespace axisd::server
