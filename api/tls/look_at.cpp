// The client's side of a handshake, to see what the other side shows.
#include <fcntl.h>
#include <netdb.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <memory>

#include "api/tls/client_check.hpp"
#include "api/tls/pem.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::tls {
namespace {

using Context = std::unique_ptr<SSL_CTX, Release<SSL_CTX, SSL_CTX_free>>;
using Handshake = std::unique_ptr<SSL, Release<SSL, SSL_free>>;
using Addresses = std::unique_ptr<addrinfo, Release<addrinfo, freeaddrinfo>>;

/// OpenSSL writes to a socket so that one whose other side has left raises SIGPIPE, which ends a program that
/// does not say otherwise. Not in this thread, as long as this lives.
class WithoutSigpipe {
 public:
  WithoutSigpipe() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    was_pending_ = sigismember(&pending, SIGPIPE) == 1;
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~WithoutSigpipe() {
    const timespec at_once{};
    while (!was_pending_ && sigtimedwait(&pipe_, nullptr, &at_once) < 0 && errno == EINTR) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  WithoutSigpipe(const WithoutSigpipe&) = delete;

 private:
  sigset_t pipe_{}, before_{};
  bool was_pending_ = false;
};

/// False: nothing came in time.
bool wait_for(int fd, short events, TimePoint until) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - monotonic_now());
    if (left.count() <= 0) return false;
    pollfd ready{.fd = fd, .events = events, .revents = 0};
    const int count = poll(&ready, 1, static_cast<int>(left.count()));
    if (count > 0) return true;
    if (count == 0 || errno != EINTR) return false;
  }
}

FileDescriptor connected(const addrinfo& address, TimePoint until) {
  FileDescriptor fd(socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd.get() < 0) return {};
  if (connect(fd.get(), address.ai_addr, address.ai_addrlen) == 0) return fd;
  if (errno != EINPROGRESS || !wait_for(fd.get(), POLLOUT, until)) return {};
  int error = 0;
  socklen_t size = sizeof error;
  if (getsockopt(fd.get(), SOL_SOCKET, SO_ERROR, &error, &size) != 0 || error != 0) return {};
  return fd;
}

FileDescriptor connected(const std::string& host, const std::string& port, TimePoint until) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  if (getaddrinfo(host.c_str(), port.c_str(), &hints, &list) != 0) return {};
  const Addresses owner(list);
  for (const auto* each = list; each != nullptr; each = each->ai_next)
    if (auto fd = connected(*each, until); fd.get() >= 0) return fd;
  return {};
}

/// Takes down what is shown, and goes on whatever it is: it is judged later.
int take_chain(X509_STORE_CTX* verification, void* shown) {
  const auto* chain = X509_STORE_CTX_get0_untrusted(verification);
  const Memory text(BIO_new(BIO_s_mem()));
  for (int i = 0; text && i < sk_X509_num(chain); ++i)
    PEM_write_bio_X509(text.get(), sk_X509_value(chain, i));
  auto& certificates = static_cast<Shown*>(shown)->certificates;
  certificates.assign(text ? BIO_ctrl_pending(text.get()) : 0, '\0');
  if (!certificates.empty()) BIO_read(text.get(), certificates.data(), static_cast<int>(certificates.size()));
  return 1;
}

/// The daemon asks for a certificate; it gets none.
int take_request(SSL* handshake, X509** /*certificate*/, EVP_PKEY** /*key*/) {
  auto& shown = *static_cast<Shown*>(SSL_get_app_data(handshake));
  shown.asks = true;
  const auto* accepted = SSL_get_client_CA_list(handshake);
  for (int i = 0; i < sk_X509_NAME_num(accepted); ++i)
    shown.accepted.push_back(name_text(sk_X509_NAME_value(accepted, i)));
  return 0;
}

/// False: what the other side said is no TLS.
bool shake_hands(SSL* handshake, int fd, TimePoint until) {
  bool spoken = true;
  for (;;) {
    ERR_clear_error();
    const int done = SSL_connect(handshake);
    const int want = done == 1 ? SSL_ERROR_NONE : SSL_get_error(handshake, done);
    if (want == SSL_ERROR_SSL) spoken = ERR_GET_REASON(ERR_peek_error()) != SSL_R_WRONG_VERSION_NUMBER;
    if (want != SSL_ERROR_WANT_READ && want != SSL_ERROR_WANT_WRITE) break;
    if (!wait_for(fd, want == SSL_ERROR_WANT_READ ? POLLIN : POLLOUT, until)) break;
  }
  ERR_clear_error();
  return spoken;
}

}  // namespace

std::optional<Shown> look_at(const std::string& host, const std::string& port, Duration patience) {
  const WithoutSigpipe without_sigpipe;
  const auto until = monotonic_now() + patience;
  const auto fd = connected(host, port, until);
  if (fd.get() < 0) return std::nullopt;
  Shown shown;
  const Context context(SSL_CTX_new(TLS_client_method()));
  if (!context) return std::nullopt;
  constexpr std::array<unsigned char, 3> h2{2, 'h', '2'};
  SSL_CTX_set_alpn_protos(context.get(), h2.data(), h2.size());
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  SSL_CTX_set_cert_verify_callback(context.get(), take_chain, &shown);
  SSL_CTX_set_client_cert_cb(context.get(), take_request);
  const Handshake handshake(SSL_new(context.get()));
  if (!handshake || SSL_set_fd(handshake.get(), fd.get()) != 1) return std::nullopt;
  SSL_set_app_data(handshake.get(), &shown);
  const bool spoken = shake_hands(handshake.get(), fd.get(), until);
  if (spoken && shown.certificates.empty()) return std::nullopt;
  return shown;
}

}  // namespace axisd::tls
