#include "api/tls/digest.hpp"

#include <fmt/format.h>
#include <openssl/sha.h>

#include <array>

namespace axisd::tls {

std::string digest_of(std::string_view text) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  std::string digits;
  for (std::size_t i = 0; i < 8; ++i) digits += fmt::format("{:02x}", digest.at(i));
  return digits;
}

}  // namespace axisd::tls
