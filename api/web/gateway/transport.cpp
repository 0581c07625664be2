#include "api/web/gateway/transport.hpp"

#include "api/tls/session.hpp"

namespace axisd::web {

std::string Transport::certificate() const {
  return tls_ ? tls::certificate_of(*tls_->native_handle()) : std::string();
}

void teardown(boost::beast::role_type, Transport& transport, boost::system::error_code&) { transport.end(); }

}  // namespace axisd::web
