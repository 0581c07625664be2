// Who may do what, as `access:` of the configuration says it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace axisd {

/// What a client may do, each including those before it.
enum class Role : std::uint8_t {
  none,        ///< what needs no role: to stop, and to ask who one is
  viewer,      ///< to read
  operator_,   ///< to move
  maintainer,  ///< to change drives and configuration, and to release what others hold
};

[[nodiscard]] constexpr std::string_view to_string(Role role) {
  constexpr std::string_view names[] = {"none", "viewer", "operator", "maintainer"};
  return names[static_cast<std::size_t>(role)];
}

/// By the name of a client, as its certificate or its unix socket proves it.
using Roles = std::map<std::string, Role, std::less<>>;

/// Between the name of a person and that of the delegate who speaks for them: "anna via web.press-1". No
/// identity has it in it.
inline constexpr std::string_view via = " via ";

/// Of a client's name that which its connection proves: of whom a delegate speaks for, the delegate.
[[nodiscard]] constexpr std::string_view identity_of(std::string_view client) {
  const auto found = client.find(via);
  return found == std::string_view::npos ? client : client.substr(found + via.size());
}

/// Where a call comes from, beside whom it is for. The audit tells it, and nothing is decided by it.
struct CallOrigin {
  std::string peer{};          ///< "ipv4:10.0.0.5:51234", "unix:axisctl"; empty: not known
  std::optional<Role> role{};  ///< of the client, on what the call names; nothing: there are no roles
};
using CallOriginPtr = std::shared_ptr<const CallOrigin>;

/// Whom these name has no role, but for what is said here.
struct AccessSettings {
  Roles roles;  ///< on the machine, and on each axis that `axes` says nothing of
  std::map<std::string, Roles, std::less<>> axes;  ///< on one axis, in place of those above
  Roles delegates;  ///< who may speak for others, and the most that these may do

  bool operator==(const AccessSettings&) const = default;
};

}  // namespace axisd
