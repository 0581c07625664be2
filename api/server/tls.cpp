#include "api/server/tls.hpp"

#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

namespace axisd::server {
namespace {

template <class T, void (*release)(T*)>
struct Release {
  void operator()(T* value) const { release(value); }
};
using Certificate = std::unique_ptr<X509, Release<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Release<EVP_PKEY, EVP_PKEY_free>>;
using Memory = std::unique_ptr<BIO, Release<BIO, BIO_free_all>>;

constexpr std::size_t largest_file = 1U << 20U;

std::unexpected<Error> wrong(const std::string& path, std::string_view what, std::string remedy) {
  ERR_clear_error();
  return fail(Reason::invalid_argument, fmt::format("{}: {}", path, what), std::move(remedy));
}

Result<std::string> read_file(const std::string& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (file.bad() || !file.is_open() || text.empty())
    return wrong(
        path, fmt::format("cannot read: {}", errno != 0 ? std::generic_category().message(errno) : "empty"),
        "check the path, and that the service's user may read it");
  if (text.size() > largest_file) return wrong(path, "too large for a PEM file", "check the path");
  return text;
}

Memory reader(const std::string& text) {
  return Memory(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// An encrypted key must fail, not ask on a terminal that a service does not have.
int no_password(char*, int, int, void*) { return -1; }

Result<Certificate> first_certificate(const std::string& path, const std::string& text) {
  const auto memory = reader(text);
  Certificate certificate(PEM_read_bio_X509(memory.get(), nullptr, no_password, nullptr));
  if (!certificate) return wrong(path, "no certificate in PEM format", "give a file with BEGIN CERTIFICATE");
  if (X509_cmp_current_time(X509_get0_notAfter(certificate.get())) < 0)
    return wrong(path, "the certificate has expired", "renew it");
  return certificate;
}

Result<void> check_chain(const std::string& path, const std::string& text) {
  const auto memory = reader(text);
  for (int count = 0;; ++count) {
    const Certificate next(PEM_read_bio_X509(memory.get(), nullptr, no_password, nullptr));
    if (next) continue;
    const bool at_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
    ERR_clear_error();
    if (at_end && count > 0) return {};
    return wrong(path, fmt::format("certificate {} is not readable", count + 1),
                 "repair or replace the file");
  }
}

Result<void> check_key(const TlsFiles& files, const std::string& text, X509* certificate) {
  const auto memory = reader(text);
  const Key key(PEM_read_bio_PrivateKey(memory.get(), nullptr, no_password, nullptr));
  if (!key)
    return wrong(files.key, "no usable private key in PEM format",
                 "give an unencrypted key with BEGIN PRIVATE KEY");
  if (X509_check_private_key(certificate, key.get()) != 1)
    return wrong(files.key, "the key does not belong to the certificate " + files.certificate,
                 "install the pair that was made together");
  return {};
}

}  // namespace

Result<std::shared_ptr<grpc::ServerCredentials>> tls_credentials(const TlsFiles& files) {
  auto chain = read_file(files.certificate);
  if (!chain) return fail(std::move(chain).error());
  auto key = read_file(files.key);
  if (!key) return fail(std::move(key).error());
  auto client_ca = read_file(files.client_ca);
  if (!client_ca) return fail(std::move(client_ca).error());

  const auto certificate = first_certificate(files.certificate, *chain);
  if (!certificate) return fail(certificate.error());
  if (const auto valid = check_chain(files.certificate, *chain); !valid) return fail(valid.error());
  if (const auto valid = check_key(files, *key, certificate->get()); !valid) return fail(valid.error());
  if (const auto valid = first_certificate(files.client_ca, *client_ca); !valid) return fail(valid.error());
  if (const auto valid = check_chain(files.client_ca, *client_ca); !valid) return fail(valid.error());

  grpc::SslServerCredentialsOptions options(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  options.pem_root_certs = *std::move(client_ca);
  options.pem_key_cert_pairs.push_back({.private_key = *std::move(key), .cert_chain = *std::move(chain)});
  return grpc::SslServerCredentials(options);
}

}  // namespace axisd::server
