// The users file: who may log in. A line each: NAME:ROLE:HASH, without a HASH for who comes with a
// certificate.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "buses/error.hpp"

namespace axisd::web {

struct User {
  std::string name;  ///< 1 to 64 printable ASCII characters without spaces and ':'
  std::string role;  ///< viewer, operator, maintainer
  std::string hash;  ///< of the password (argon2id); empty: by certificate only
  friend bool operator==(const User&, const User&) = default;
};
using Users = std::vector<User>;

inline constexpr std::size_t longest_user_name = 64;
[[nodiscard]] bool is_user_name(std::string_view text);
[[nodiscard]] bool is_role(std::string_view text);
/// nullptr: there is none.
[[nodiscard]] const User* find_user(const Users& users, std::string_view name);

/// Of who comes with a certificate of that name: what the file says of a user without a password, else
/// "viewer". A name that logs in with a password is somebody else's.
[[nodiscard]] std::string_view role_of_certificate(const Users& users, std::string_view name);

/// `path` leads errors: invalid_argument, with the line.
[[nodiscard]] Result<Users> parse_users(std::string_view text, const std::string& path);
[[nodiscard]] std::string to_text(const Users& users);

/// Of a file that is not there: nobody. Blocks for the disk. Errors: invalid_argument (also: others may read
/// it), storage.
[[nodiscard]] Result<Users> load_users(const std::string& path);
/// Exchanges the file as a whole; nobody but its owner may read it, who is that of its directory where we may
/// say so. Blocks for the disk. Errors: storage.
[[nodiscard]] Result<void> save_users(const std::string& path, const Users& users);

}  // namespace axisd::web
