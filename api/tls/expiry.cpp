#include "api/tls/expiry.hpp"

#include <openssl/asn1.h>
#include <openssl/x509.h>

#include <algorithm>
#include <ctime>

#include "api/tls/pem.hpp"
#include "buses/regular_file.hpp"

namespace axisd::tls {
namespace {

constexpr std::size_t largest_file = 1U << 20U;

Result<WallTime> expiry_of(const std::string& path, const Certificate& certificate) {
  std::tm end{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(certificate.get()), &end) != 1)
    return wrong(path, "a certificate has no readable end", "replace it");
  return std::chrono::system_clock::from_time_t(timegm(&end));
}

}  // namespace

Result<WallTime> first_expiry(const std::string& path) {
  const auto text = read_regular_file(path, largest_file);
  if (!text) return fail(text.error());
  const auto all = certificates(path, *text);
  if (!all) return fail(all.error());
  auto first = WallTime::max();
  for (const auto& certificate : *all) {
    const auto expires = expiry_of(path, certificate);
    if (!expires) return expires;
    first = std::min(first, *expires);
  }
  return first;
}

}  // namespace axisd::tls
