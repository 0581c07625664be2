#include "api/tls/identity.hpp"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/x509.h>

#include <algorithm>
#include <cstdint>

#include "api/tls/digest.hpp"
#include "api/tls/pem.hpp"

namespace axisd::tls {
namespace {

constexpr std::size_t longest_name = 128, longest_beginning = 96;

std::string common_name(const X509* certificate) {
  const auto* subject = X509_get_subject_name(certificate);
  const int at = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
  return at < 0 ? std::string() : utf8_of(X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at)));
}

std::string encoded_name(const X509_NAME* name) { return encoded(name, i2d_X509_NAME); }
std::string encoded_key(const X509* certificate) {
  return encoded<EVP_PKEY>(X509_get0_pubkey(certificate), i2d_PUBKEY);
}

bool has_signed(const Authority& authority, X509* certificate) {
  const auto* der = reinterpret_cast<const unsigned char*>(authority.key.data());
  const Key key(d2i_PUBKEY(nullptr, &der, static_cast<long>(authority.key.size())));
  return key && X509_verify(certificate, key.get()) == 1;
}

/// Who issued the first of them, by its signature: one name may be of several. One that is not among
/// `authorities` is among those shown, or without a key.
Authority issuer_of_first(const std::vector<Certificate>& shown, const std::vector<Authority>& authorities) {
  auto* certificate = shown.front().get();
  Authority issuer{
      .name = encoded_name(X509_get_issuer_name(certificate)), .key = {}, .shares_its_name = true};
  const auto known = std::ranges::find_if(
      authorities, [&](const Authority& authority) { return has_signed(authority, certificate); });
  for (std::size_t i = 1; i < shown.size() && known == authorities.end() && issuer.key.empty(); ++i) {
    const Authority between{.name = issuer.name, .key = encoded_key(shown[i].get())};
    if (has_signed(between, certificate)) issuer.key = between.key;
  }
  ERR_clear_error();
  return known == authorities.end() ? issuer : *known;
}

/// What stands for it: equal for the same authority only.
std::string text_of(const Authority& authority) {
  // A name begins with another byte, so that none looks like a name and a key.
  return authority.shares_its_name ? '\0' + authority.name + authority.key : authority.name;
}

/// Can stand for its client as it is: nothing else that is named here or by the server looks like it.
bool is_plain(std::string_view name) {
  const bool printable = std::ranges::all_of(name, [](char c) { return c >= ' ' && c < '~'; });
  const bool taken = name.starts_with("local:") || name.starts_with("unix:") ||
                     name.starts_with("unnamed:") || name.contains(" via ");
  return printable && !taken && name.size() <= longest_name;
}

std::string beginning_of(std::string_view name) {
  std::string text(name.substr(0, longest_beginning));
  std::ranges::replace_if(text, [](char c) { return c <= ' ' || c >= '~'; }, '?');
  return text;
}

}  // namespace

Identities::Identities(const std::string& client_ca) {
  const auto all = certificates("client_ca", client_ca);
  for (std::size_t i = 0; all && i < all->size(); ++i) {
    const auto* certificate = (*all)[i].get();
    Authority next{.name = encoded_name(X509_get_subject_name(certificate)), .key = encoded_key(certificate)};
    for (auto& other : authorities_)
      if (other.name == next.name && other.key != next.key)
        other.shares_its_name = next.shares_its_name = true;
    authorities_.push_back(std::move(next));
  }
}

std::string Identities::of(const std::string& pem) const {
  const auto all = certificates("the client's certificate", pem);
  if (!all) return "unnamed:" + digest_of(pem);
  auto* certificate = all->front().get();
  auto name = common_name(certificate);
  if (const auto others = alternatives_of(certificate); name.empty() && !others.empty())
    name = others.front();
  ERR_clear_error();
  if (name.empty()) return "unnamed:" + digest_of(encoded(certificate, i2d_X509));
  const auto issuer = text_of(issuer_of_first(*all, authorities_));
  const bool first = !authorities_.empty() && issuer == text_of(authorities_.front());
  if (first && is_plain(name)) return name;
  // What stands for the issuer says how long it is: no two pairs make the same text.
  return fmt::format("{}~{}", beginning_of(name), digest_of(issuer + name));
}

}  // namespace axisd::tls
