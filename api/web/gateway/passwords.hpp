// Hashes of passwords: argon2id. Each call takes some 0.1 s and 64 MiB, on purpose.
#pragma once

#include <string>

namespace axisd::web {

inline constexpr std::size_t shortest_password = 8, longest_password = 1024;

/// Before anything else here. False: there is no usable source of random numbers.
[[nodiscard]] bool start_passwords();
/// Empty: there is not enough memory.
[[nodiscard]] std::string hash_of_password(const std::string& password);
/// Of a `hash` that is no hash: false, at once.
[[nodiscard]] bool password_fits(const std::string& hash, const std::string& password);

}  // namespace axisd::web
