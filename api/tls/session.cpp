#include "api/tls/session.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>

#include <array>
#include <utility>

#include "api/tls/pem.hpp"

namespace axisd::tls {
namespace {

constexpr std::array<unsigned char, 3> h2{2, 'h', '2'};

int choose_protocol(SSL*, const unsigned char** chosen, unsigned char* length, const unsigned char* offered,
                    unsigned int offered_length, void*) {
  unsigned char* match = nullptr;
  if (SSL_select_next_proto(&match, length, h2.data(), h2.size(), offered, offered_length) !=
      OPENSSL_NPN_NEGOTIATED)
    return SSL_TLSEXT_ERR_ALERT_FATAL;
  *chosen = match;
  return SSL_TLSEXT_ERR_OK;
}

std::unexpected<Error> refused(std::string_view what) {
  ERR_clear_error();
  return fail(Reason::invalid_argument, std::string("TLS: ") + std::string(what),
              "check the files of server.tls with axisctl check");
}

}  // namespace

void Acceptor::Free::operator()(ssl_ctx_st* context) const { SSL_CTX_free(context); }
void Session::Free::operator()(ssl_st* session) const { SSL_free(session); }

Result<std::shared_ptr<const Acceptor>> Acceptor::make(const Files& contents) {
  const auto chain = certificates("server.tls.certificate", contents.certificate);
  if (!chain) return fail(chain.error());
  const auto key = private_key("server.tls.key", contents.key);
  if (!key) return fail(key.error());
  const auto authorities = certificates("server.tls.client_ca", contents.client_ca);
  if (!authorities) return fail(authorities.error());

  std::shared_ptr<Acceptor> acceptor(new Acceptor);
  acceptor->context_.reset(SSL_CTX_new(TLS_server_method()));
  auto* context = acceptor->context_.get();
  if (context == nullptr) return refused("no memory");
  bool fine = SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION) == 1;
  // Nothing of a session is kept for another one, neither here nor by the client.
  SSL_CTX_set_options(context, SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  fine = fine && SSL_CTX_set_num_tickets(context, 0) == 1;
  SSL_CTX_set_mode(context, SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_set_max_cert_list(context, 32L * 1024);
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  SSL_CTX_set_alpn_select_cb(context, choose_protocol, nullptr);
  fine = fine && SSL_CTX_use_certificate(context, chain->front().get()) == 1;
  for (std::size_t i = 1; i < chain->size(); ++i)
    fine = fine && SSL_CTX_add1_chain_cert(context, (*chain)[i].get()) == 1;
  fine = fine && SSL_CTX_use_PrivateKey(context, key->get()) == 1;
  auto* trusted = SSL_CTX_get_cert_store(context);
  // As gRPC does: an authority need not be a root.
  X509_STORE_set_flags(trusted, X509_V_FLAG_PARTIAL_CHAIN | X509_V_FLAG_TRUSTED_FIRST);
  for (const auto& authority : *authorities) {
    fine = fine && X509_STORE_add_cert(trusted, authority.get()) == 1;
    fine = fine && SSL_CTX_add_client_CA(context, authority.get()) == 1;
  }
  if (!fine) return refused("the certificates are not usable");
  return acceptor;
}

Session::Session(std::shared_ptr<const Acceptor> acceptor)
    : acceptor_(std::move(acceptor)), session_(SSL_new(acceptor_->context())) {
  if (!session_) throw std::bad_alloc();
  SSL_set_bio(session_.get(), BIO_new(BIO_s_mem()), BIO_new(BIO_s_mem()));
  SSL_set_accept_state(session_.get());
}

bool Session::receive(std::string_view bytes, std::string& plain) {
  auto* in = SSL_get_rbio(session_.get());
  if (!bytes.empty() &&
      BIO_write(in, bytes.data(), static_cast<int>(bytes.size())) != static_cast<int>(bytes.size()))
    return false;
  std::array<char, 4096> piece;
  for (;;) {
    // Errors of other sessions of this thread must not be taken for this one's.
    ERR_clear_error();
    const int count = SSL_read(session_.get(), piece.data(), piece.size());
    if (count <= 0) return SSL_get_error(session_.get(), count) == SSL_ERROR_WANT_READ;
    plain.append(piece.data(), static_cast<std::size_t>(count));
  }
}

bool Session::send(std::string_view plain) {
  ERR_clear_error();
  // Into memory, everything goes at once.
  return plain.empty() || SSL_write(session_.get(), plain.data(), static_cast<int>(plain.size())) ==
                              static_cast<int>(plain.size());
}

std::string Session::take_output() {
  auto* out = SSL_get_wbio(session_.get());
  std::string bytes(BIO_ctrl_pending(out), '\0');
  if (!bytes.empty()) BIO_read(out, bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

bool Session::established() const { return SSL_is_init_finished(session_.get()) == 1; }

std::string Session::certificate() const { return certificate_of(*session_); }

std::string certificate_of(const ssl_st& session) {
  const Certificate peer(SSL_get1_peer_certificate(&session));
  const Memory text(BIO_new(BIO_s_mem()));
  if (!peer || !text || PEM_write_bio_X509(text.get(), peer.get()) != 1) return {};
  const auto* shown = SSL_get_peer_cert_chain(&session);
  for (int i = 0; i < sk_X509_num(shown); ++i) PEM_write_bio_X509(text.get(), sk_X509_value(shown, i));
  std::string pem(BIO_ctrl_pending(text.get()), '\0');
  BIO_read(text.get(), pem.data(), static_cast<int>(pem.size()));
  return pem;
}

}  // namespace axisd::tls
