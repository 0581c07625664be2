#include "api/tls/client_check.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <utility>

#include "api/tls/pem.hpp"
#include "api/tls/time_text.hpp"

namespace axisd::tls {
namespace {

Error refused(std::string message, std::string remedy) {
  ERR_clear_error();
  return {.reason = Reason::unauthenticated, .message = std::move(message), .remedy = std::move(remedy)};
}

std::string when(const ASN1_TIME* time) { return to_text(time_of(time).value_or(WallTime::min())); }

bool is_address(const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  return inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 ||
         inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
}

bool is_for(X509* certificate, const std::string& host) {
  return is_address(host) ? X509_check_ip_asc(certificate, host.c_str(), 0) == 1
                          : X509_check_host(certificate, host.c_str(), host.size(), 0, nullptr) == 1;
}

/// Why the daemon's own certificate does not verify: where OpenSSL stopped.
Error why_not_trusted(X509_STORE_CTX* verification, const X509* own) {
  const int code = X509_STORE_CTX_get_error(verification);
  const auto* at = X509_STORE_CTX_get_current_cert(verification);
  if (code == X509_V_ERR_CERT_HAS_EXPIRED && at != nullptr &&
      X509_STORE_CTX_get_error_depth(verification) > 0)
    return refused(fmt::format("the authority that signed the daemon's certificate has expired ({})",
                               when(X509_get0_notAfter(at))),
                   "renew it, and give its new certificate as --tls-ca");
  if (code == X509_V_ERR_CERT_HAS_EXPIRED && at != nullptr)
    return refused(fmt::format("the daemon's certificate has expired ({})", when(X509_get0_notAfter(at))),
                   "renew it there");
  if (code == X509_V_ERR_CERT_NOT_YET_VALID && at != nullptr)
    return refused(
        fmt::format("the daemon's certificate is not valid before {}", when(X509_get0_notBefore(at))),
        "compare the clocks of both computers");
  if (code == X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY || code == X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT ||
      code == X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN || code == X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT ||
      code == X509_V_ERR_CERT_SIGNATURE_FAILURE)
    return refused(fmt::format("the daemon's certificate is signed by {}, which is not in --tls-ca",
                               name_text(X509_get_issuer_name(own))),
                   "give the certificate of the authority of that machine");
  return refused(
      fmt::format("the daemon's certificate is not accepted: {}", X509_verify_cert_error_string(code)),
      "give it one for daemons, of an authority of --tls-ca");
}

std::optional<Error> judge_daemon(const std::vector<Certificate>& shown, const std::string& ca,
                                  WallTime now) {
  const auto authorities = certificates("--tls-ca", ca);
  if (!authorities) return authorities.error();
  const Store store(X509_STORE_new());
  const Verification verification(X509_STORE_CTX_new());
  const List between(sk_X509_new_null());
  if (!store || !verification || !between) return std::nullopt;
  X509_STORE_set_flags(store.get(), X509_V_FLAG_PARTIAL_CHAIN | X509_V_FLAG_TRUSTED_FIRST);
  for (const auto& authority : *authorities) X509_STORE_add_cert(store.get(), authority.get());
  for (std::size_t i = 1; i < shown.size(); ++i) sk_X509_push(between.get(), shown[i].get());
  auto* context = verification.get();
  if (X509_STORE_CTX_init(context, store.get(), shown.front().get(), between.get()) != 1 ||
      X509_STORE_CTX_set_default(context, "ssl_server") != 1)
    return std::nullopt;
  X509_STORE_CTX_set_time(context, 0, std::chrono::system_clock::to_time_t(now));
  if (X509_verify_cert(context) == 1) return std::nullopt;
  return why_not_trusted(context, shown.front().get());
}

std::optional<Error> judge_host(X509* certificate, const std::string& host) {
  if (is_for(certificate, host)) return std::nullopt;
  auto names = alternatives_of(certificate);
  if (names.empty()) names.push_back(name_text(X509_get_subject_name(certificate)));
  return refused(
      fmt::format("the daemon's certificate is for {}, you called {}", fmt::join(names, ", "), host),
      fmt::format("call it by a name of its certificate, or give it one for {}", host));
}

}  // namespace

std::optional<Error> wrong_with(const ClientFiles& files, WallTime now) {
  if (files.certificate.empty()) return std::nullopt;
  const auto own = certificates("--tls-cert", files.certificate);
  if (!own) return own.error();
  const auto key = private_key("--tls-key", files.key);
  if (!key) return key.error();
  auto* first = own->front().get();
  if (X509_check_private_key(first, key->get()) != 1)
    return wrong("--tls-key", "the key does not belong to the certificate of --tls-cert",
                 "give the pair that was made together")
        .error();
  const auto from = time_of(X509_get0_notBefore(first)), until = time_of(X509_get0_notAfter(first));
  if (until && *until < now)
    return wrong("--tls-cert", fmt::format("the certificate has expired ({})", to_text(*until)), "renew it")
        .error();
  if (from && *from > now)
    return wrong("--tls-cert", fmt::format("the certificate is not valid before {}", to_text(*from)),
                 "set the clock of this computer, or give another one")
        .error();
  return std::nullopt;
}

std::optional<Error> why_refused(const ClientFiles& files, const Shown& shown, const std::string& host,
                                 WallTime now) {
  if (files.ca.empty() && shown.certificates.empty()) return std::nullopt;
  if (files.ca.empty())
    return refused("the daemon speaks TLS",
                   "give --tls-ca, and where it asks for it --tls-cert and --tls-key");
  if (shown.certificates.empty())
    return refused("the daemon speaks no TLS at that address",
                   "leave out --tls-ca, or call its address for TLS");
  const auto all = certificates("the daemon's certificate", shown.certificates);
  if (!all) return all.error();
  if (auto error = judge_daemon(*all, files.ca, now)) return error;
  if (auto error = judge_host(all->front().get(), host)) return error;
  if (!shown.asks) return std::nullopt;
  if (files.certificate.empty())
    return refused("the daemon asks for a certificate of the client", "give --tls-cert and --tls-key");
  const auto own = certificates("--tls-cert", files.certificate);
  if (!own) return own.error();
  const auto issuer = name_text(X509_get_issuer_name(own->back().get()));
  if (shown.accepted.empty() || std::ranges::find(shown.accepted, issuer) != shown.accepted.end())
    return std::nullopt;
  return refused(
      fmt::format("the daemon does not take certificates of {}, which signed that of --tls-cert", issuer),
      fmt::format("give one of {}", fmt::join(shown.accepted, ", or of ")));
}

}  // namespace axisd::tls
