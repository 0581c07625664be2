// Certificates and keys as OpenSSL has them. For this folder alone.
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/tls/time_text.hpp"
#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd::tls {

template <class T, void (*release)(T*)>
struct Release {
  void operator()(T* value) const { release(value); }
};
using Certificate = std::unique_ptr<X509, Release<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Release<EVP_PKEY, EVP_PKEY_free>>;
using RevocationList = std::unique_ptr<X509_CRL, Release<X509_CRL, X509_CRL_free>>;
using Store = std::unique_ptr<X509_STORE, Release<X509_STORE, X509_STORE_free>>;
using Verification = std::unique_ptr<X509_STORE_CTX, Release<X509_STORE_CTX, X509_STORE_CTX_free>>;
using Memory = std::unique_ptr<BIO, Release<BIO, BIO_free_all>>;

/// A list of certificates that belong to somebody else.
inline void free_list(STACK_OF(X509) * list) { sk_X509_free(list); }
using List = std::unique_ptr<STACK_OF(X509), Release<STACK_OF(X509), free_list>>;

/// An error of the file at `path`; OpenSSL's own list of errors is emptied.
[[nodiscard]] std::unexpected<Error> wrong(const std::string& path, std::string_view what,
                                           std::string remedy);

/// All certificates of a PEM text, at least one. `path` leads errors: invalid_argument.
[[nodiscard]] Result<std::vector<Certificate>> certificates(const std::string& path, const std::string& text);
/// The unencrypted private key of a PEM text. `path` leads errors: invalid_argument.
[[nodiscard]] Result<Key> private_key(const std::string& path, const std::string& text);

/// All revocation lists (CRLs) of a PEM text, at least one. `path` leads errors: invalid_argument.
[[nodiscard]] Result<std::vector<RevocationList>> revocation_lists(const std::string& path,
                                                                   const std::string& text);

/// Which of them issued the list: its name, and its signature. nullptr: none.
[[nodiscard]] const X509* issuer_of(const RevocationList& list, const std::vector<Certificate>& authorities);

/// Times beyond what WallTime can say (the year 2262) are its first or last. Nothing: `time` is not readable.
[[nodiscard]] std::optional<WallTime> time_of(const ASN1_TIME* time);

/// A string of a certificate; empty: there is none, or it is not readable.
[[nodiscard]] std::string utf8_of(const ASN1_STRING* from);
/// "CN=cell-1,O=press".
[[nodiscard]] std::string name_text(const X509_NAME* name);
/// The alternative names of a certificate that can be shown: hosts, URIs, mail and network addresses.
[[nodiscard]] std::vector<std::string> alternatives_of(const X509* certificate);

/// The bytes of an object, by one of OpenSSL's i2d functions.
template <class T>
[[nodiscard]] std::string encoded(const T* object, int (*encode)(const T*, unsigned char**)) {
  unsigned char* der = nullptr;
  const int length = encode(object, &der);
  std::string bytes = length > 0 ? std::string(reinterpret_cast<const char*>(der), length) : std::string();
  OPENSSL_free(der);
  return bytes;
}

}  // namespace axisd::tls
