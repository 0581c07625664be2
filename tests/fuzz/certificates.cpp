// Certificates, revocation lists and keys: of clients, who are strangers, and of the files of `server.tls`.
// As PEM, or as the bytes (DER) that PEM wraps, in which a fuzzer gets further.
#include <openssl/pem.h>

#include <algorithm>

#include "api/tls/client_check.hpp"
#include "api/tls/clients.hpp"
#include "api/tls/expiry.hpp"
#include "api/tls/identity.hpp"
#include "api/tls/pem.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

/// An authority that is good until the year 2125.
const std::string authority =
    "-----BEGIN CERTIFICATE-----\n"
    "MIIBnjCCAUOgAwIBAgIUOegwzJ25hIwmmSBfKw1o9QSzHccwCgYIKoZIzj0EAwIw\n"
    "IzENMAsGA1UECgwEZnV6ejESMBAGA1UEAwwJYXV0aG9yaXR5MCAXDTI2MTEyNzAy\n"
    "MTIxN1oYDzIxMjUwNjIxMDIxMjE3WjAjMQ0wCwYDVQQKDARmdXp6MRIwEAYDVQQD\n"
    "DAlhdXRob3JpdHkwWTATBgcqhkjOPQIBBggqhkjOPQMBBwNCAAR66SGRx6E8Je4q\n"
    "Fgr+3dHSdeQbgC4OTo4xn6xB6fOHzSCL+z8Xv7jinN3y/WEOHE9nYPWNepixmuwe\n"
    "f8rDQwTao1MwUTAdBgNVHQ4EFgQUER1ffBhPyiCgb0FnyT//42FbGecwHwYDVR0j\n"
    "BBgwFoAUER1ffBhPyiCgb0FnyT//42FbGecwDwYDVR0TAQH/BAUwAwEB/zAKBggq\n"
    "hkjOPQQDAgNJADBGAiEAlKKbvYvWlUYjE7C3fWfNYaADaDw2CKIEsg4/96pntagC\n"
    "IQCooYPOETgzTXIi2Xqg6bvLRXKWnd1bu7y7oDGq6dW5EQ==\n"
    "-----END CERTIFICATE-----\n";
constexpr WallTime now{std::chrono::seconds(1'800'000'000)};

std::string wrapped(const char* name, std::span<const std::uint8_t> der) {
  const tls::Memory memory(BIO_new(BIO_s_mem()));
  if (PEM_write_bio(memory.get(), name, "", der.data(), static_cast<long>(der.size())) <= 0) return {};
  char* bytes = nullptr;
  const auto size = BIO_get_mem_data(memory.get(), &bytes);
  return {bytes, static_cast<std::size_t>(size)};
}

void expect_one_line(const Error& error) {
  expect(!error.message.empty() && error.message.find('\n') == std::string::npos, "an error is one line");
}

/// Of who has shown it in a handshake, and behind it those that it came with.
void client(const std::string& pem) {
  static const tls::Identities identities(authority);
  static const tls::Clients clients({.certificate = {}, .key = {}, .client_ca = authority});
  const auto name = identities.of(pem);
  expect(!name.empty() && name.size() <= 128, "a client has a name");
  expect(std::ranges::all_of(name, [](char c) { return c >= ' ' && c <= '~'; }), "a name is printable");
  const auto client = clients.of(pem, now);
  expect(client.name == name, "a client has one name");
  expect(client.refusal.has_value(), "whom the authority did not sign for is refused");
  expect_one_line(*client.refusal);
}

void texts(const std::string& pem) {
  (void)tls::first_expiry(pem);
  const auto read = tls::certificates("f", pem);
  if (!read) return expect_one_line(read.error());
  for (const auto& certificate : *read) {
    (void)tls::name_text(X509_get_subject_name(certificate.get()));
    (void)tls::alternatives_of(certificate.get());
    (void)tls::time_of(X509_get0_notAfter(certificate.get()));
  }
}

void own(const std::string& pem) {
  if (const auto why = tls::wrong_with({.ca = pem, .certificate = pem, .key = {}}, now))
    expect_one_line(*why);
}

void daemons(const std::string& pem) {
  if (const auto why = tls::why_refused({.ca = authority, .certificate = {}, .key = {}},
                                        {.certificates = pem, .accepted = {}}, "localhost", now))
    expect_one_line(*why);
}

void revocation_lists(const std::string& pem) {
  const auto read = tls::revocation_lists("f", pem);
  if (!read) return expect_one_line(read.error());
  static const auto authorities = *tls::certificates("f", authority);
  for (const auto& list : *read) {
    (void)tls::issuer_of(list, authorities);
    (void)tls::time_of(X509_CRL_get0_nextUpdate(list.get()));
  }
}

}  // namespace

void run(Input input) {
  const auto first = input.byte();
  const auto kind = first % 6;
  const auto bytes = input.rest();
  const auto as = [&](const char* name) {
    return kind < 3 ? std::string(text(bytes)) : wrapped(name, bytes);
  };
  constexpr void (*of_certificates[])(const std::string&) = {client, texts, own, daemons};
  if (kind % 3 == 0)
    of_certificates[first / 6 % std::size(of_certificates)](as("CERTIFICATE"));
  else if (kind % 3 == 1)
    revocation_lists(as("X509 CRL"));
  else if (const auto key = tls::private_key("f", as("PRIVATE KEY")); !key)
    expect_one_line(key.error());
}

}  // namespace axisd::fuzz
