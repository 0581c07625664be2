#include "api/tls/pem.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <utility>

namespace axisd::tls {
namespace {

Memory reader(const std::string& text) {
  return Memory(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// An encrypted key must fail, not ask on a terminal that a service does not have.
int no_password(char*, int, int, void*) { return -1; }

std::string address_of(const ASN1_OCTET_STRING* from) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool v4 = ASN1_STRING_length(from) == 4;
  if (!v4 && ASN1_STRING_length(from) != 16) return {};
  const auto* bytes = ASN1_STRING_get0_data(from);
  return inet_ntop(v4 ? AF_INET : AF_INET6, bytes, text.data(), text.size()) != nullptr ? text.data() : "";
}

/// All that `read` finds in a PEM text. `name`, `mark`: of one of them, and of its first line.
template <class Thing, class Read>
Result<std::vector<Thing>> all_of(const std::string& path, const std::string& text, Read read,
                                  std::string_view name, std::string_view mark) {
  const auto memory = reader(text);
  std::vector<Thing> all;
  for (;;) {
    Thing next(read(memory.get(), nullptr, no_password, nullptr));
    if (next) {
      all.push_back(std::move(next));
      continue;
    }
    const bool at_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
    ERR_clear_error();
    if (at_end && !all.empty()) return all;
    if (at_end)
      return wrong(path, fmt::format("no {} in PEM format", name), fmt::format("give a file with {}", mark));
    return wrong(path, fmt::format("{} {} is not readable", name, all.size() + 1),
                 "repair or replace the file");
  }
}

}  // namespace

std::unexpected<Error> wrong(const std::string& path, std::string_view what, std::string remedy) {
  ERR_clear_error();
  return fail(Reason::invalid_argument, fmt::format("{}: {}", path, what), std::move(remedy));
}

Result<std::vector<Certificate>> certificates(const std::string& path, const std::string& text) {
  return all_of<Certificate>(path, text, PEM_read_bio_X509, "certificate", "BEGIN CERTIFICATE");
}

Result<std::vector<RevocationList>> revocation_lists(const std::string& path, const std::string& text) {
  return all_of<RevocationList>(path, text, PEM_read_bio_X509_CRL, "CRL", "BEGIN X509 CRL");
}

Result<Key> private_key(const std::string& path, const std::string& text) {
  const auto memory = reader(text);
  Key key(PEM_read_bio_PrivateKey(memory.get(), nullptr, no_password, nullptr));
  if (!key)
    return wrong(path, "no usable private key in PEM format",
                 "give an unencrypted key with BEGIN PRIVATE KEY");
  return key;
}

const X509* issuer_of(const RevocationList& list, const std::vector<Certificate>& authorities) {
  const X509* issuer = nullptr;
  for (const auto& authority : authorities) {
    if (X509_NAME_cmp(X509_CRL_get_issuer(list.get()), X509_get_subject_name(authority.get())) != 0) continue;
    // The same name may be of several authorities.
    if (X509_CRL_verify(list.get(), X509_get0_pubkey(authority.get())) == 1) issuer = authority.get();
  }
  ERR_clear_error();
  return issuer;
}

std::string name_text(const X509_NAME* name) {
  const Memory text(BIO_new(BIO_s_mem()));
  // Names are for people: letters stay as they are, as UTF-8.
  constexpr unsigned long flags = XN_FLAG_RFC2253 & ~ASN1_STRFLGS_ESC_MSB;
  if (!text || name == nullptr || X509_NAME_print_ex(text.get(), name, 0, flags) < 0) return {};
  std::string bytes(BIO_ctrl_pending(text.get()), '\0');
  if (!bytes.empty()) BIO_read(text.get(), bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

std::vector<std::string> alternatives_of(const X509* certificate) {
  using Names = std::unique_ptr<GENERAL_NAMES, Release<GENERAL_NAMES, GENERAL_NAMES_free>>;
  const Names names(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
  std::vector<std::string> all;
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const auto* name = sk_GENERAL_NAME_value(names.get(), i);
    std::string text;
    // One member of the union has the strings of all three kinds.
    if (name->type == GEN_DNS || name->type == GEN_URI || name->type == GEN_EMAIL)
      text = utf8_of(name->d.ia5);
    else if (name->type == GEN_IPADD)
      text = address_of(name->d.iPAddress);
    if (!text.empty()) all.push_back(std::move(text));
  }
  ERR_clear_error();
  return all;
}

std::string utf8_of(const ASN1_STRING* from) {
  unsigned char* utf8 = nullptr;
  const int length = from == nullptr ? -1 : ASN1_STRING_to_UTF8(&utf8, from);
  std::string text = length > 0 ? std::string(reinterpret_cast<const char*>(utf8), length) : std::string();
  OPENSSL_free(utf8);
  return text;
}

std::optional<WallTime> time_of(const ASN1_TIME* time) {
  std::tm parts{};
  if (time == nullptr || ASN1_TIME_to_tm(time, &parts) != 1) return std::nullopt;
  const std::chrono::seconds since(timegm(&parts));
  const auto first = std::chrono::ceil<std::chrono::seconds>(WallTime::min().time_since_epoch());
  const auto last = std::chrono::floor<std::chrono::seconds>(WallTime::max().time_since_epoch());
  return WallTime(std::clamp(since, first, last));
}

}  // namespace axisd::tls
