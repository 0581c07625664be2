// A connection's bytes, with or without TLS, as one type: what reads HTTP and WebSockets is made once.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/system/error_code.hpp>
#include <memory>
#include <string>
#include <utility>

namespace axisd::web {

/// An AsyncReadStream and AsyncWriteStream of Asio.
class Transport {
 public:
  using Socket = boost::asio::ip::tcp::socket;
  using executor_type = Socket::executor_type;

  explicit Transport(Socket socket) : socket_(std::make_unique<Socket>(std::move(socket))) {}
  Transport(Socket socket, boost::asio::ssl::context& context) : Transport(std::move(socket)) {
    tls_ = std::make_unique<Tls>(*socket_, context);
  }

  [[nodiscard]] executor_type get_executor() { return socket_->get_executor(); }
  [[nodiscard]] Socket& socket() { return *socket_; }
  [[nodiscard]] bool encrypted() const { return tls_ != nullptr; }
  /// Of the client, in PEM format; empty: it has shown none.
  [[nodiscard]] std::string certificate() const;

  /// Precondition: encrypted().
  template <class Handler>
  void async_handshake(Handler&& handler) {
    tls_->async_handshake(boost::asio::ssl::stream_base::server, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    if (tls_)
      tls_->async_read_some(buffers, std::forward<Handler>(handler));
    else
      socket_->async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    if (tls_)
      tls_->async_write_some(buffers, std::forward<Handler>(handler));
    else
      socket_->async_write_some(buffers, std::forward<Handler>(handler));
  }
  /// At once: whatever is under way on it fails.
  void close() {
    boost::system::error_code ignored;
    socket_->close(ignored);
  }
  /// The other end reads what was sent to it, and then the end.
  void end() {
    boost::system::error_code ignored;
    socket_->shutdown(Socket::shutdown_send, ignored);
  }

 private:
  using Tls = boost::asio::ssl::stream<Socket&>;
  std::unique_ptr<Socket> socket_;
  std::unique_ptr<Tls> tls_;
};

/// How Beast ends a WebSocket's connection: at once where it is late, else in order.
inline void beast_close_socket(Transport& transport) { transport.close(); }
void teardown(boost::beast::role_type role, Transport& transport, boost::system::error_code& error);
template <class Handler>
void async_teardown(boost::beast::role_type, Transport& transport, Handler&& handler) {
  transport.end();
  boost::asio::post(transport.get_executor(), [handler = std::forward<Handler>(handler)]() mutable {
    handler(boost::system::error_code());
  });
}

}  // namespace axisd::web
