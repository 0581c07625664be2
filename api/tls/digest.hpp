#pragma once

#include <string>
#include <string_view>

namespace axisd::tls {

/// 16 digits of a SHA-256: nobody finds another text with the same ones.
[[nodiscard]] std::string digest_of(std::string_view text);

}  // namespace axisd::tls
