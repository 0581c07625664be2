#include "api/transport/peer_certificates.hpp"

#include <grpc/grpc_security_constants.h>

namespace axisd::transport {

std::string certificates_of(const grpc::ServerContextBase& context) {
  std::string pem;
  const auto auth = context.auth_context();
  if (!auth) return pem;
  for (const auto* property : {GRPC_X509_PEM_CERT_PROPERTY_NAME, GRPC_X509_PEM_CERT_CHAIN_PROPERTY_NAME})
    for (const auto& value : auth->FindPropertyValues(property)) pem.append(value.data(), value.size());
  return pem;
}

}  // namespace axisd::transport
