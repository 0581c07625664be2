#include "api/server/access.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "axisd/v1/access.pb.h"

namespace axisd::server {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

constexpr std::size_t longest_user = 64;

/// Appears in the log and in Command.client: it must not be able to forge anything there.
bool usable_user(std::string_view user) {
  return !user.empty() && user.size() <= longest_user &&
         std::ranges::all_of(user, [](char c) { return c > ' ' && c <= '~'; });
}

std::optional<Role> role_named(std::string_view name) {
  for (const auto role : {Role::viewer, Role::operator_, Role::maintainer})
    if (to_string(role) == name) return role;
  return std::nullopt;
}

Role in(const Roles& roles, std::string_view identity) {
  const auto found = roles.find(identity);
  return found == roles.end() ? Role::none : found->second;
}

Role from_proto(v1::Role role) {
  switch (role) {
    case v1::ROLE_NONE:
      return Role::none;
    case v1::ROLE_VIEWER:
      return Role::viewer;
    case v1::ROLE_OPERATOR:
      return Role::operator_;
    default:  // a call that the contract gives to nobody is not everybody's
      return Role::maintainer;
  }
}

/// Each call has a request of its own, in the file of its service. StopService has those of the others.
const MethodDescriptor* call_with(const google::protobuf::Descriptor& request) {
  const auto& file = *request.file();
  for (int i = 0; i < file.service_count(); ++i)
    for (int j = 0; j < file.service(i)->method_count(); ++j)
      if (file.service(i)->method(j)->input_type() == &request) return file.service(i)->method(j);
  return nullptr;
}

bool names_axes(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_STRING &&
         (field.name() == "axis" || field.name() == "axes" || field.name() == "group");
}

bool is_ours(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE &&
         field.message_type()->file()->package() == v1::Access::descriptor()->file()->package();
}

/// Adds what the fields that are set ask for.
void collect(const Message& message, Demand& demand) {
  const auto& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> set;
  reflection.ListFields(message, &set);
  for (const auto* field : set) {
    if (field->options().HasExtension(v1::needs))
      demand.role = std::max(demand.role, from_proto(field->options().GetExtension(v1::needs)));
    const int size = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
    for (int i = 0; i < size && (names_axes(*field) || is_ours(*field)); ++i) {
      if (is_ours(*field))
        collect(field->is_repeated() ? reflection.GetRepeatedMessage(message, field, i)
                                     : reflection.GetMessage(message, field),
                demand);
      else
        demand.names.push_back(field->is_repeated() ? reflection.GetRepeatedString(message, field, i)
                                                    : reflection.GetString(message, field));
    }
  }
}

/// `most`: what a delegate may lend.
std::string way_to_role(const Caller& caller, Role needed, Role most) {
  if (!caller.lent)
    return fmt::format("ask somebody who has it, or give {} that role under access: in the configuration",
                       caller.identity);
  if (most >= needed) return fmt::format("ask with {}: {}", role_key, to_string(needed));
  return fmt::format("give {} that role under access: delegates in the configuration", caller.identity);
}

std::unexpected<Error> denied(const AccessSettings& access, const Caller& caller, const Demand& demand,
                              Role has, std::string_view where) {
  const auto needed = to_string(demand.role);
  auto remedy = way_to_role(caller, demand.role, in(access.delegates, caller.identity));
  return fail(
      Reason::access_denied,
      fmt::format("{} needs the role {}{}{}; {} has {}", demand.call, needed, where.empty() ? "" : " on ",
                  where, caller.name, has == Role::none ? "none" : to_string(has)),
      std::move(remedy));
}

std::unexpected<Error> unusable(std::string_view key, std::string_view what, std::string remedy) {
  return fail(Reason::invalid_argument, fmt::format("the metadata {} {}", key, what), std::move(remedy));
}

bool has_somewhere(const AccessSettings& access, const Caller& caller, Role role) {
  return std::ranges::any_of(access.axes,
                             [&](const auto& axis) { return role_of(&access, caller, axis.first) >= role; });
}

}  // namespace

Result<Caller> caller_of(const AccessSettings* access, const Peer& peer, const Claim& claim) {
  if (!claim.user && !claim.role) return Caller{.name = peer.name, .identity = peer.name};
  const auto found = access == nullptr ? Roles::const_iterator() : access->delegates.find(peer.name);
  if (access == nullptr || found == access->delegates.end())
    return fail(Reason::access_denied, fmt::format("{} may not speak for others", peer.name),
                fmt::format("leave out the metadata {} and {}, or name {} under access: delegates in the "
                            "configuration",
                            user_key, role_key, peer.name));
  if (!claim.user || !usable_user(*claim.user))
    return unusable(user_key, claim.user ? "is not usable" : "is missing",
                    fmt::format("give 1 to {} printable ASCII characters without spaces", longest_user));
  const auto asked = claim.role ? role_named(*claim.role) : found->second;
  if (!asked) return unusable(role_key, "is no role", "give viewer, operator or maintainer");
  return Caller{.name = fmt::format("{}{}{}", *claim.user, via, peer.name),
                .identity = peer.name,
                .lent = std::min(*asked, found->second)};
}

std::string rpc_of(const Message& request) {
  const auto* call = call_with(*request.GetDescriptor());
  return call == nullptr ? std::string() : fmt::format("{}.{}", call->service()->name(), call->name());
}

Demand demand_of(const Message& request) {
  Demand demand;
  if (const auto* call = call_with(*request.GetDescriptor())) {
    const auto& needed = call->options().GetExtension(v1::access);
    demand = {.call = call->name(), .role = from_proto(needed.role()), .anywhere = needed.anywhere()};
  }
  collect(request, demand);
  return demand;
}

std::vector<std::string> axes_of(std::span<const std::string> names, std::span<const GroupSettings> groups) {
  std::vector<std::string> axes;
  for (const auto& name : names) {
    const auto group = std::ranges::find(groups, name, &GroupSettings::name);
    if (group == groups.end())
      axes.push_back(name);
    else
      axes.insert(axes.end(), group->axes.begin(), group->axes.end());
  }
  return axes;
}

AccessSettings expanded(AccessSettings settings, std::span<const GroupSettings> groups) {
  std::map<std::string, Roles, std::less<>> of_groups;
  for (const auto& group : groups) {
    const auto said = settings.axes.extract(group.name);
    if (said.empty()) continue;
    for (const auto& axis : group.axes)
      for (const auto& [identity, role] : said.mapped()) {
        const auto [place, added] = of_groups[axis].try_emplace(identity, role);
        place->second = std::min(place->second, role);
      }
  }
  for (const auto& [axis, roles] : of_groups) settings.axes[axis].insert(roles.begin(), roles.end());
  return settings;
}

Role role_of(const AccessSettings* access, const Caller& caller) {
  if (access == nullptr) return Role::maintainer;
  return caller.lent ? *caller.lent : in(access->roles, caller.identity);
}

Role role_of(const AccessSettings* access, const Caller& caller, std::string_view axis) {
  if (access == nullptr || caller.lent) return role_of(access, caller);
  const auto found = access->axes.find(axis);
  const bool said = found != access->axes.end() && found->second.contains(caller.identity);
  return said ? in(found->second, caller.identity) : role_of(access, caller);
}

Result<void> permits(const AccessSettings& access, const Caller& caller, const Demand& demand,
                     std::span<const std::string> axes) {
  for (const auto& axis : axes)
    if (const auto has = role_of(&access, caller, axis); has < demand.role)
      return denied(access, caller, demand, has, axis);
  if (!axes.empty()) return {};
  const auto has = role_of(&access, caller);
  if (has >= demand.role || (demand.anywhere && has_somewhere(access, caller, demand.role))) return {};
  return denied(access, caller, demand, has, {});
}

Result<Caller> admitted(const AccessSettings* access, const Peer& peer, const Claim& claim,
                        const Message& request, std::span<const GroupSettings> groups) {
  if (peer.refusal) return fail(*peer.refusal);
  auto caller = caller_of(access, peer, claim);
  if (access == nullptr && caller) return caller;
  const auto demand = demand_of(request);
  if (demand.role == Role::none) return admitted_caller(access, peer, claim);
  if (!caller || access == nullptr) return caller;
  if (auto may = permits(*access, *caller, demand, axes_of(demand.names, groups)); !may)
    return fail(std::move(may).error());
  return caller;
}

Caller admitted_caller(const AccessSettings* access, const Peer& peer, const Claim& claim) {
  auto caller = caller_of(access, peer, claim);
  return caller ? *std::move(caller) : Caller{.name = peer.name, .identity = peer.name};
}

CallOriginPtr origin_of(const AccessSettings* access, const Peer& peer, const Caller& caller,
                        const Message& request, std::span<const GroupSettings> groups) {
  CallOrigin origin{.peer = peer.address};
  if (access != nullptr) {
    const auto axes = axes_of(demand_of(request).names, groups);
    auto role = axes.empty() ? role_of(access, caller) : Role::maintainer;
    for (const auto& axis : axes) role = std::min(role, role_of(access, caller, axis));
    origin.role = role;
  }
  return std::make_shared<const CallOrigin>(std::move(origin));
}

void AccessControl::replace(std::optional<AccessSettings> settings) {
  auto next = settings ? std::make_shared<const AccessSettings>(*std::move(settings)) : nullptr;
  const std::lock_guard lock(mutex_);
  settings_ = std::move(next);
}

std::shared_ptr<const AccessSettings> AccessControl::settings() const {
  const std::lock_guard lock(mutex_);
  return settings_;
}

}  // namespace axisd::server
