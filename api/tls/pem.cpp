#include "api/tls/pem.hpp"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/pem.h>

#include <utility>

namespace axisd::tls {
namespace {

Memory reader(const std::string& text) {
  return Memory(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// An encrypted key must fail, not ask on a terminal that a service does not have.
int no_password(char*, int, int, void*) { return -1; }

}  // namespace

std::unexpected<Error> wrong(const std::string& path, std::string_view what, std::string remedy) {
  ERR_clear_error();
  return fail(Reason::invalid_argument, fmt::format("{}: {}", path, what), std::move(remedy));
}

Result<std::vector<Certificate>> certificates(const std::string& path, const std::string& text) {
  const auto memory = reader(text);
  std::vector<Certificate> all;
  for (;;) {
    Certificate next(PEM_read_bio_X509(memory.get(), nullptr, no_password, nullptr));
    if (next) {
      all.push_back(std::move(next));
      continue;
    }
    const bool at_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
    ERR_clear_error();
    if (at_end && !all.empty()) return all;
    if (at_end) return wrong(path, "no certificate in PEM format", "give a file with BEGIN CERTIFICATE");
    return wrong(path, fmt::format("certificate {} is not readable", all.size() + 1),
                 "repair or replace the file");
  }
}

Result<Key> private_key(const std::string& path, const std::string& text) {
  const auto memory = reader(text);
  Key key(PEM_read_bio_PrivateKey(memory.get(), nullptr, no_password, nullptr));
  if (!key)
    return wrong(path, "no usable private key in PEM format",
                 "give an unencrypted key with BEGIN PRIVATE KEY");
  return key;
}

}  // namespace axisd::tls
