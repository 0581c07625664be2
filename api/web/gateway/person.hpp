// Who is at a page.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace axisd::web {

/// How the gateway knows somebody.
enum class How : std::uint8_t {
  password,
  certificate,
  loopback,  ///< everybody at this computer, as there are no users: the gateway's own identity
};

/// "password"
[[nodiscard]] constexpr std::string_view to_string(How how) {
  return how == How::password ? "password" : how == How::certificate ? "certificate" : "loopback";
}

/// Whom a call is made for. What they may do the daemon decides: the gateway only says who it is.
struct Person {
  std::string name;  ///< as the daemon is told (axisd-user), but for loopback
  std::string role;  ///< "operator" (axisd-role)
  How how = How::password;

  /// Who shares quotas.
  [[nodiscard]] std::string key() const { return std::string(to_string(how).substr(0, 1)) + name; }
  friend bool operator==(const Person&, const Person&) = default;
};

}  // namespace axisd::web
