#include "api/tls/clients.hpp"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/sha.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "api/tls/pem.hpp"

namespace axisd::tls {
namespace {

constexpr std::size_t most_known = 1024;
/// A refused certificate is looked at again: it may be good later, and whoever asks often with it must not
/// cost much.
constexpr auto refused_for = std::chrono::seconds(1);

Error refusal(const std::string& name, std::string_view what, std::string remedy) {
  return {.reason = Reason::unauthenticated,
          .message = fmt::format("the certificate of {} {}", name, what),
          .remedy = std::move(remedy)};
}

/// When the first of a chain ends.
WallTime end_of(STACK_OF(X509) * chain) {
  auto end = WallTime::max();
  for (int i = 0; i < sk_X509_num(chain); ++i)
    end = std::min(end, time_of(X509_get0_notAfter(sk_X509_value(chain, i))).value_or(WallTime::min()));
  return end;
}

/// The handshake has seen that all of the chain had begun: by now the clock may have stepped back.
int take_what_has_not_begun(int good, X509_STORE_CTX* verification) {
  if (good == 1 || X509_STORE_CTX_get_error(verification) != X509_V_ERR_CERT_NOT_YET_VALID) return good;
  X509_STORE_CTX_set_error(verification, X509_V_OK);
  return 1;
}

/// No two texts have the same.
std::string digest_of(const std::string& text) {
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

/// Of a chain that was not accepted.
Error why_not(const std::string& name, X509_STORE_CTX* verification) {
  const int code = X509_STORE_CTX_get_error(verification);
  const auto* certificate = X509_STORE_CTX_get_current_cert(verification);
  const bool own = X509_STORE_CTX_get_error_depth(verification) == 0;
  const std::string whose = own ? "" : "is of an authority whose own ";
  if (code == X509_V_ERR_CERT_HAS_EXPIRED && certificate != nullptr)
    return refusal(name,
                   fmt::format("{}has expired ({})", whose,
                               to_text(time_of(X509_get0_notAfter(certificate)).value_or(WallTime::min()))),
                   "renew it, then connect again");
  if (code == X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY || code == X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT ||
      code == X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN || code == X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT)
    return refusal(name, "is not of an authority that the daemon trusts (server.tls.client_ca)",
                   "connect with a certificate of one that it does");
  return refusal(name, fmt::format("is not accepted: {}", X509_verify_cert_error_string(code)),
                 "connect with another certificate");
}

}  // namespace

struct Clients::Trusted {
  /// A list, and who issued it.
  struct Revoked {
    RevocationList list;
    const X509* issuer;
  };
  std::vector<Certificate> authorities;
  Store store{X509_STORE_new()};
  std::vector<Revoked> revoked;

  explicit Trusted(const Files& contents) {
    if (auto all = certificates("client_ca", contents.client_ca); all) authorities = *std::move(all);
    // As gRPC does: an authority need not be a root.
    X509_STORE_set_flags(store.get(), X509_V_FLAG_PARTIAL_CHAIN | X509_V_FLAG_TRUSTED_FIRST);
    for (const auto& authority : authorities) X509_STORE_add_cert(store.get(), authority.get());
    ERR_clear_error();
    if (contents.crl.empty()) return;
    auto lists = revocation_lists("crl", contents.crl);
    for (std::size_t i = 0; lists && i < lists->size(); ++i)
      if (const auto* issuer = issuer_of((*lists)[i], authorities); issuer != nullptr)
        revoked.push_back({.list = std::move((*lists)[i]), .issuer = issuer});
  }

  /// When it was revoked; nothing: it was not.
  [[nodiscard]] std::optional<WallTime> revocation_of(X509* certificate) const {
    for (const auto& [list, issuer] : revoked) {
      X509_REVOKED* entry = nullptr;
      if (X509_NAME_cmp(X509_CRL_get_issuer(list.get()), X509_get_issuer_name(certificate)) != 0 ||
          X509_verify(certificate, X509_get0_pubkey(issuer)) != 1 ||
          X509_CRL_get0_by_cert(list.get(), &entry, certificate) != 1)
        continue;
      return time_of(X509_REVOKED_get0_revocationDate(entry)).value_or(WallTime::min());
    }
    return std::nullopt;
  }
};

Clients::Clients(const Files& contents)
    : identities_(contents.client_ca), trusted_(std::make_unique<const Trusted>(contents)) {}

Clients::~Clients() = default;

Client Clients::of(const std::string& pem, WallTime now) const {
  auto digest = digest_of(pem);
  {
    const std::lock_guard lock(mutex_);
    const auto found = known_.find(digest);
    if (found != known_.end() && found->second.from <= now && now <= found->second.until)
      return found->second.client;
  }
  auto known = look_at(pem, now);
  const std::lock_guard lock(mutex_);
  if (known_.size() >= most_known) known_.clear();
  return known_.insert_or_assign(std::move(digest), std::move(known)).first->second.client;
}

Clients::Known Clients::look_at(const std::string& pem, WallTime now) const {
  Known known{.client = {.name = identities_.of(pem)}, .from = now, .until = now + refused_for};
  auto& refused = known.client.refusal;
  const auto& name = known.client.name;
  const auto shown = certificates("the client's certificate", pem);
  if (!shown) {
    refused = refusal(name, "is not readable", "connect with another one");
    return known;
  }
  const Verification verification(X509_STORE_CTX_new());
  const List between(sk_X509_new_null());
  for (std::size_t i = 1; i < shown->size() && between; ++i) sk_X509_push(between.get(), (*shown)[i].get());
  auto* context = verification.get();
  const bool ready =
      context != nullptr && between &&
      X509_STORE_CTX_init(context, trusted_->store.get(), shown->front().get(), between.get()) == 1 &&
      X509_STORE_CTX_set_default(context, "ssl_client") == 1;
  if (!ready) {
    refused = refusal(name, "could not be looked at: no memory", "connect again");
    return known;
  }
  X509_STORE_CTX_set_time(context, 0, std::chrono::system_clock::to_time_t(now));
  X509_STORE_CTX_set_verify_cb(context, take_what_has_not_begun);
  const bool good = X509_verify_cert(context) == 1;
  auto* chain = X509_STORE_CTX_get0_chain(context);
  if (!good) refused = why_not(name, context);
  for (int i = 0; good && !refused && i < sk_X509_num(chain); ++i)
    if (const auto since = trusted_->revocation_of(sk_X509_value(chain, i)))
      refused = refusal(
          name,
          fmt::format("{} revoked ({})", i == 0 ? "was" : "is of an authority that was", to_text(*since)),
          "connect with another certificate");
  if (!refused) {
    known.from = WallTime::min();
    known.until = end_of(chain);
  }
  ERR_clear_error();
  return known;
}

}  // namespace axisd::tls
