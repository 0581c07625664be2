#include "config/access_warnings.hpp"

#include <algorithm>

namespace axisd::config {
namespace {

Role highest(const Roles& roles) {
  auto found = Role::none;
  for (const auto& [identity, role] : roles) found = std::max(found, role);
  return found;
}

}  // namespace

std::vector<std::string> access_warnings(const Configuration& configuration) {
  if (!configuration.access) return {};
  const auto& access = *configuration.access;
  auto found = std::max(highest(access.roles), highest(access.delegates));
  for (const auto& [axis, roles] : access.axes) found = std::max(found, highest(roles));
  if (found == Role::none)
    return {
        "access: nobody has a role: every client can stop, and nothing else; name clients under "
        "access.roles, or leave access out, so that everybody may do everything"};
  if (found == Role::viewer)
    return {
        "access: nobody has a role above viewer: no client can move anything; give one the role operator "
        "or maintainer"};
  return {};
}

}  // namespace axisd::config
