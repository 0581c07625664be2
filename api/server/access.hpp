// Who may make which call: what a request asks for, and what its client may do. Pure, but for AccessControl.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/error.hpp"
#include "devices/access.hpp"
#include "devices/group/group.hpp"

namespace axisd::server {

/// The other end of a connection, as the connection proves it.
struct Peer {
  std::string name;       ///< "shift-a", "unix:anna": by which `access:` knows it
  std::string program{};  ///< of a unix socket, as the program calls itself: shown, and nothing else
  std::string address{};  ///< "ipv4:10.0.0.5:51234", "unix:axisctl": shown, and nothing else
  /// Why nothing is taken from it, stops included: its certificate is not, or no longer, good.
  std::optional<Error> refusal{};
};

/// What the metadata of a call says of whom it is made for. Unset: nothing.
struct Claim {
  std::optional<std::string> user;  ///< axisd-user
  std::optional<std::string> role;  ///< axisd-role
};
inline constexpr std::string_view user_key = "axisd-user", role_key = "axisd-role";

/// Whom a call is made for.
struct Caller {
  std::string name;            ///< "shift-a", or "anna via web.press-1"
  std::string identity;        ///< of the peer
  std::optional<Role> lent{};  ///< of whom a delegate speaks for: what they may do, on every axis
  CallOriginPtr origin{};      ///< nullptr: it was not asked for
};

/// What a call asks for (proto/axisd/v1/access.proto).
struct Demand {
  std::string_view call;           ///< "MoveAbsolute"
  Role role = Role::maintainer;    ///< of a call of which the contract says nothing, too
  bool anywhere = false;           ///< on the machine or on any axis
  std::vector<std::string> names;  ///< of axes and groups
};

/// Whom the call is for. `access`: nullptr: the configuration has none, and nobody speaks for others.
/// Errors: access_denied (the peer is no delegate), invalid_argument (the metadata is not usable).
[[nodiscard]] Result<Caller> caller_of(const AccessSettings* access, const Peer& peer, const Claim& claim);

/// "AxisService.Enable". Precondition: as of demand_of().
[[nodiscard]] std::string rpc_of(const google::protobuf::Message& request);

/// What the request's call asks for, from the descriptors. Precondition: `request` is one of a call's.
[[nodiscard]] Demand demand_of(const google::protobuf::Message& request);

/// The axes that these names stand for, a group for each of its own. What is neither is kept.
[[nodiscard]] std::vector<std::string> axes_of(std::span<const std::string> names,
                                               std::span<const GroupSettings> groups);

/// The same settings, with the axes of each group in its place. What is said of an axis itself goes first,
/// then the least of what is said of its groups.
[[nodiscard]] AccessSettings expanded(AccessSettings settings, std::span<const GroupSettings> groups);

/// What the caller may do on the machine; on one axis.
[[nodiscard]] Role role_of(const AccessSettings* access, const Caller& caller);
[[nodiscard]] Role role_of(const AccessSettings* access, const Caller& caller, std::string_view axis);

/// Whether the caller may. `axes`: those of the demand; none: the machine. Errors: access_denied, naming the
/// role that is missing, and where.
[[nodiscard]] Result<void> permits(const AccessSettings& access, const Caller& caller, const Demand& demand,
                                   std::span<const std::string> axes);

/// Whom a request is for, where they may make it. What needs no role is refused to nobody but a peer with a
/// refusal: of somebody whose metadata is not usable it is taken as their own.
[[nodiscard]] Result<Caller> admitted(const AccessSettings* access, const Peer& peer, const Claim& claim,
                                      const google::protobuf::Message& request,
                                      std::span<const GroupSettings> groups);
/// Whom a call is for that was admitted.
[[nodiscard]] Caller admitted_caller(const AccessSettings* access, const Peer& peer, const Claim& claim);

/// Where a request of this caller comes from, with the role that the caller has: the least on what it names.
[[nodiscard]] CallOriginPtr origin_of(const AccessSettings* access, const Peer& peer, const Caller& caller,
                                      const google::protobuf::Message& request,
                                      std::span<const GroupSettings> groups);

/// The table that is in force: all doors of the daemon look at the same one. Thread: any.
class AccessControl {
 public:
  /// `settings`: nothing: everybody may do everything.
  explicit AccessControl(std::optional<AccessSettings> settings = std::nullopt) {
    replace(std::move(settings));
  }
  void replace(std::optional<AccessSettings> settings);
  /// nullptr: there is none.
  [[nodiscard]] std::shared_ptr<const AccessSettings> settings() const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const AccessSettings> settings_;
};

}  // namespace axisd::server
