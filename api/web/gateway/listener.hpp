// Lets browsers in.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/web/gateway/gateway.hpp"
#include "api/web/gateway/settings.hpp"
#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd::web {

/// TLS 1.2 or newer. Blocks for the disk. Errors: invalid_argument.
[[nodiscard]] Result<std::unique_ptr<boost::asio::ssl::context>> make_tls(const TlsSettings& settings);

/// Goes on whatever happens, also out of descriptors. Thread: the gateway's.
class Listener {
 public:
  /// `tls`: nullptr: without. Blocks for name resolution. Errors: busy (in use), offline, invalid_argument.
  [[nodiscard]] static Result<std::unique_ptr<Listener>> open(Gateway& gateway,
                                                              std::unique_ptr<boost::asio::ssl::context> tls);
  Listener(const Listener&) = delete;

  [[nodiscard]] int port() const { return port_; }
  /// Nobody is let in any more.
  void close();

 private:
  using Tcp = boost::asio::ip::tcp;
  struct Door {
    Tcp::acceptor acceptor;
    Clock::Timer pause{};
  };
  Listener(Gateway& gateway, std::unique_ptr<boost::asio::ssl::context> tls)
      : gateway_(gateway), tls_(std::move(tls)) {}
  [[nodiscard]] Result<void> listen();
  void wait(Door& door);
  void let_in(Tcp::socket socket);

  Gateway& gateway_;
  std::unique_ptr<boost::asio::ssl::context> tls_;
  std::vector<std::unique_ptr<Door>> doors_;
  int port_ = 0;
  TimePoint told_{};  ///< that a connection could not be taken
};

}  // namespace axisd::web
