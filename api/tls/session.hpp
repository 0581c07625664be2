// The server's side of mutual TLS, over bytes in memory: sockets are the caller's affair.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "api/tls/pem_files.hpp"
#include "buses/error.hpp"

struct ssl_ctx_st;
struct ssl_st;

namespace axisd::tls {

/// What all sessions share: the server's certificate and key, and whom it accepts. TLS 1.2 or newer, clients
/// without a certificate of `client_ca` are refused, HTTP/2 is the only protocol (ALPN). Thread: any.
class Acceptor {
 public:
  /// `contents`: as read() gives them. Errors: invalid_argument.
  [[nodiscard]] static Result<std::shared_ptr<const Acceptor>> make(const Files& contents);

  [[nodiscard]] ssl_ctx_st* context() const { return context_.get(); }

 private:
  struct Free {
    void operator()(ssl_ctx_st* context) const;
  };
  Acceptor() = default;
  std::unique_ptr<ssl_ctx_st, Free> context_;
};

/// One connection. Thread: one at a time.
class Session {
 public:
  explicit Session(std::shared_ptr<const Acceptor> acceptor);

  /// Takes in bytes of the peer and appends what they say to `plain`: never more than came. False: the
  /// connection is over, and take_output() may hold the last word on it.
  [[nodiscard]] bool receive(std::string_view bytes, std::string& plain);
  /// Encrypts; the result is in take_output(). Precondition: established().
  [[nodiscard]] bool send(std::string_view plain);
  /// What has to go to the peer next.
  [[nodiscard]] std::string take_output();

  /// The handshake is over, and the peer's certificate is good.
  [[nodiscard]] bool established() const;
  /// The peer's certificate in PEM format, and behind it those that it came with. Precondition:
  /// established().
  [[nodiscard]] std::string certificate() const;

 private:
  struct Free {
    void operator()(ssl_st* session) const;
  };
  std::shared_ptr<const Acceptor> acceptor_;
  std::unique_ptr<ssl_st, Free> session_;
};

/// The peer's certificate in PEM format, of a session of anybody's; empty: it has shown none.
[[nodiscard]] std::string certificate_of(const ssl_st& session);

}  // namespace axisd::tls
