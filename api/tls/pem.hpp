// Certificates and keys as OpenSSL has them. For this folder alone.
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "buses/error.hpp"

namespace axisd::tls {

template <class T, void (*release)(T*)>
struct Release {
  void operator()(T* value) const { release(value); }
};
using Certificate = std::unique_ptr<X509, Release<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Release<EVP_PKEY, EVP_PKEY_free>>;
using Memory = std::unique_ptr<BIO, Release<BIO, BIO_free_all>>;

/// An error of the file at `path`; OpenSSL's own list of errors is emptied.
[[nodiscard]] std::unexpected<Error> wrong(const std::string& path, std::string_view what,
                                           std::string remedy);

/// All certificates of a PEM text, at least one. `path` leads errors: invalid_argument.
[[nodiscard]] Result<std::vector<Certificate>> certificates(const std::string& path, const std::string& text);
/// The unencrypted private key of a PEM text. `path` leads errors: invalid_argument.
[[nodiscard]] Result<Key> private_key(const std::string& path, const std::string& text);

}  // namespace axisd::tls
