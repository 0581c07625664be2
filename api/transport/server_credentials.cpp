#include "api/transport/server_credentials.hpp"

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <utility>

namespace axisd::transport {
namespace {

/// Of one port only: what was handed over is remembered here, and a second port would be told that nothing is
/// new. gRPC's C++ layer has no credentials that change, its core has: before each handshake it asks for
/// those that are new. grpc::experimental::TlsServerCredentials has others only from files that gRPC reads by
/// itself, of which a damaged pair would end all handshakes.
class LiveCredentials final : public grpc::ServerCredentials {
 public:
  explicit LiveCredentials(std::shared_ptr<const tls::Live> live)
      : live_(std::move(live)),
        credentials_(grpc_ssl_server_credentials_create_with_options(
            grpc_ssl_server_credentials_create_options_using_config_fetcher(
                GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY, &LiveCredentials::fetch, this))) {
  }
  ~LiveCredentials() override { grpc_server_credentials_release(credentials_); }
  LiveCredentials(const LiveCredentials&) = delete;

  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>& /*processor*/) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }

  /// Thread: whoever hands over a connection, one at a time.
  static grpc_ssl_certificate_config_reload_status fetch(void* self,
                                                         grpc_ssl_server_certificate_config** config) {
    auto& own = *static_cast<LiveCredentials*>(self);
    const auto served = own.live_->served();
    if (own.handed_.exchange(served->number) == served->number)
      return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const auto& contents = served->contents;
    const grpc_ssl_pem_key_cert_pair pair{.private_key = contents.key.c_str(),
                                          .cert_chain = contents.certificate.c_str()};
    *config = grpc_ssl_server_certificate_config_create(contents.client_ca.c_str(), &pair, 1);
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  const std::shared_ptr<const tls::Live> live_;
  std::atomic<std::uint64_t> handed_{0};  ///< Generation::number; 0: none yet
  grpc_server_credentials* const credentials_;
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> tls_credentials(std::shared_ptr<const tls::Live> live) {
  return std::make_shared<LiveCredentials>(std::move(live));
}

}  // namespace axisd::transport
