#include "api/web/gateway/listener.hpp"

#include <fmt/format.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include <boost/asio/ip/v6_only.hpp>
#include <boost/system/errc.hpp>
#include <utility>

#include "api/transport/address.hpp"
#include "api/web/gateway/connection.hpp"
#include "api/web/gateway/transport.hpp"

namespace axisd::web {

namespace asio = boost::asio;
using Error_code = boost::system::error_code;

namespace {

/// After a connection could not be taken, for want of descriptors.
constexpr Duration breather = std::chrono::milliseconds(100);
constexpr Duration seldom = std::chrono::minutes(1);

/// A browser that lost its link is noticed by the kernel.
void watch_link(asio::ip::tcp::socket& socket) {
  const auto set = [&](int level, int name, int value) {
    (void)::setsockopt(socket.native_handle(), level, name, &value, sizeof value);
  };
  set(IPPROTO_TCP, TCP_NODELAY, 1);
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 10);
  set(IPPROTO_TCP, TCP_KEEPINTVL, 5);
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);
  set(IPPROTO_TCP, TCP_USER_TIMEOUT, 30'000);
}

Error_code listen_at(asio::ip::tcp::acceptor& opened, const asio::ip::tcp::endpoint& endpoint) {
  Error_code error;
  if (endpoint.protocol() == asio::ip::tcp::v6()) opened.set_option(asio::ip::v6_only(true), error);
  if (!error) opened.set_option(asio::ip::tcp::acceptor::reuse_address(true), error);
  if (!error) opened.bind(endpoint, error);
  if (!error) opened.listen(asio::socket_base::max_listen_connections, error);
  return error;
}

}  // namespace

Result<std::unique_ptr<asio::ssl::context>> make_tls(const TlsSettings& settings) {
  auto context = std::make_unique<asio::ssl::context>(asio::ssl::context::tls_server);
  Error_code error;
  std::string what;
  const auto attempt = [&](const std::string& path, auto use) {
    if (error) return;
    use(error);
    if (error) what = path;
  };
  context->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_sslv2 |
                           asio::ssl::context::no_sslv3 | asio::ssl::context::no_tlsv1 |
                           asio::ssl::context::no_tlsv1_1 | asio::ssl::context::no_compression |
                           SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION,
                       error);
  // Nothing of a session is kept for another one.
  SSL_CTX_set_session_cache_mode(context->native_handle(), SSL_SESS_CACHE_OFF);
  attempt(settings.certificate,
          [&](Error_code& e) { context->use_certificate_chain_file(settings.certificate, e); });
  attempt(settings.key,
          [&](Error_code& e) { context->use_private_key_file(settings.key, asio::ssl::context::pem, e); });
  if (!settings.client_ca.empty()) {
    attempt(settings.client_ca, [&](Error_code& e) { context->load_verify_file(settings.client_ca, e); });
    // So that a browser offers those of these authorities; who has none logs in with a password.
    if (!error)
      SSL_CTX_set_client_CA_list(context->native_handle(),
                                 SSL_load_client_CA_file(settings.client_ca.c_str()));
    attempt(settings.client_ca, [&](Error_code& e) { context->set_verify_mode(asio::ssl::verify_peer, e); });
  }
  if (error)
    return fail(Reason::invalid_argument, fmt::format("{}: not usable for TLS: {}", what, error.message()),
                "check the files of tls: PEM, readable, and the key that of the certificate");
  return context;
}

Result<std::unique_ptr<Listener>> Listener::open(Gateway& gateway, std::unique_ptr<asio::ssl::context> tls) {
  std::unique_ptr<Listener> listener(new Listener(gateway, std::move(tls)));
  if (auto listens = listener->listen(); !listens) return fail(std::move(listens).error());
  return listener;
}

Result<void> Listener::listen() {
  const auto address = transport::host_and_port(gateway_.settings.listen);
  if (!address) return fail(Reason::invalid_argument, "no address to listen on", "write listen: HOST:PORT");
  Error_code error;
  const auto found =
      Tcp::resolver(gateway_.io).resolve(address->host, address->port, Tcp::resolver::passive, error);
  if (error)
    return fail(Reason::offline, fmt::format("{}: {}", gateway_.settings.listen, error.message()),
                "check 'listen'");
  for (const auto& entry : found) {
    auto endpoint = entry.endpoint();
    if (endpoint.port() == 0) endpoint.port(static_cast<std::uint16_t>(port_));  // the same for all
    Tcp::acceptor acceptor(gateway_.io);
    acceptor.open(endpoint.protocol(), error);
    if (error && !doors_.empty()) continue;  // there is no IPv6 here
    if (!error) error = listen_at(acceptor, endpoint);
    if (error == boost::system::errc::address_not_available && found.size() > 1) continue;
    if (error)
      return fail(error == asio::error::address_in_use ? Reason::busy : Reason::offline,
                  fmt::format("{}: {}", gateway_.settings.listen, error.message()),
                  "check 'listen', and that nothing else listens there");
    port_ = acceptor.local_endpoint(error).port();
    doors_.push_back(std::make_unique<Door>(Door{.acceptor = std::move(acceptor)}));
  }
  if (doors_.empty())
    return fail(Reason::offline, fmt::format("{}: no such address here", gateway_.settings.listen),
                "check 'listen'");
  for (const auto& door : doors_) wait(*door);
  return {};
}

void Listener::close() {
  for (const auto& door : doors_) {
    Error_code ignored;
    door->pause.reset();
    door->acceptor.close(ignored);
  }
}

void Listener::wait(Door& door) {
  door.acceptor.async_accept([this, &door](Error_code error, Tcp::socket socket) {
    if (!door.acceptor.is_open()) return;
    if (error) {
      if (gateway_.clock.now() >= told_ + seldom) {
        told_ = gateway_.clock.now();
        spdlog::warn("a connection could not be taken: {}", error.message());
      }
      door.pause = gateway_.clock.call_at(gateway_.clock.now() + breather, [this, &door] { wait(door); });
      return;
    }
    let_in(std::move(socket));
    wait(door);
  });
}

void Listener::let_in(Tcp::socket socket) {
  Error_code error;
  const auto peer = socket.remote_endpoint(error);
  if (error) return;
  auto address = peer.address().to_string();
  // Whoever wants to stop connects now: there is room, as long as anybody does nothing.
  if (gateway_.connections.full()) (void)gateway_.make_room();
  auto place = gateway_.connections.take(address);
  if (!place) return;
  watch_link(socket);
  auto transport = tls_ ? Transport(std::move(socket), *tls_) : Transport(std::move(socket));
  const auto connection =
      std::make_shared<Connection>(gateway_, std::move(transport), std::move(address), *std::move(place));
  gateway_.enter(connection);
  connection->start();
}

}  // namespace axisd::web
