#include "api/server/callers.hpp"

#include <fmt/format.h>

#include <utility>

#include "api/server/local_peer.hpp"
#include "api/server/peer.hpp"
#include "api/transport/peer_certificates.hpp"

namespace axisd::server {
namespace {

/// How gRPC calls a connection that it was given by its number.
constexpr std::string_view given = "fd:";
std::string name_of(int connection) { return fmt::format("{}{}", given, connection); }

std::optional<std::string> metadata(const grpc::CallbackServerContext& context, std::string_view key) {
  const auto found = context.client_metadata().find({key.data(), key.size()});
  if (found == context.client_metadata().end()) return std::nullopt;
  return std::string(found->second.data(), found->second.size());
}

Claim claim_of(const grpc::CallbackServerContext& context) {
  return {.user = metadata(context, user_key), .role = metadata(context, role_key)};
}

}  // namespace

Callers::Callers(Machine& machine, std::shared_ptr<const AccessControl> access, AuditSink* audit)
    : machine_(machine),
      access_(access ? std::move(access) : std::make_shared<const AccessControl>()),
      refusals_(machine, audit) {}

void Callers::enter(int connection) {
  auto peer = local_peer(connection);
  const std::lock_guard lock(mutex_);
  local_.insert_or_assign(name_of(connection), std::move(peer));
}

Peer Callers::peer_of(const grpc::CallbackServerContext& context) const {
  const auto shown = live_ ? transport::certificates_of(context) : std::string();
  if (!shown.empty()) {
    auto client = live_->served()->clients.of(shown, machine_.wall(machine_.now()));
    return {.name = std::move(client.name), .address = context.peer(), .refusal = std::move(client.refusal)};
  }
  const auto connection = context.peer();
  if (connection.starts_with(given)) {
    const std::lock_guard lock(mutex_);
    if (const auto found = local_.find(connection); found != local_.end()) return found->second;
  }
  Peer peer{.name = "local:" + peer_host(connection), .address = connection};
  // Beside the sockets above nothing but TLS is listened to, which asks for a certificate.
  if (live_)
    peer.refusal = Error{.reason = Reason::unauthenticated,
                         .message = "no certificate was shown",
                         .remedy = "connect with one"};
  return peer;
}

OpenCalls::Judge Callers::judge_of(const grpc::CallbackServerContext& context) const {
  auto shown = live_ ? transport::certificates_of(context) : std::string();
  if (shown.empty()) return {};
  return [live = live_, machine = &machine_, pem = std::move(shown)] {
    return live->served()->clients.of(pem, machine->wall(machine->now())).refusal;
  };
}

Result<void> Callers::admit(const grpc::CallbackServerContext& context,
                            const google::protobuf::Message& request) {
  const auto access = access_->settings();
  const auto claim = claim_of(context);
  if (!live_ && !access && !claim.user && !claim.role) return {};
  const auto peer = peer_of(context);
  const auto groups = groups_for(access.get());
  const auto admission = admitted(access.get(), peer, claim, request, groups);
  if (admission) return {};
  auto caller = admitted_caller(access.get(), peer, claim);
  caller.origin = origin_of(access.get(), peer, caller, request, groups);
  refusals_.tell(caller, request, admission.error());
  return fail(admission.error());
}

std::vector<GroupSettings> Callers::groups_for(const AccessSettings* access) const {
  return access == nullptr ? std::vector<GroupSettings>() : machine_.group_access().groups();
}

Caller Callers::of(const grpc::CallbackServerContext& context) const {
  const auto access = access_->settings();
  return admitted_caller(access.get(), peer_of(context), claim_of(context));
}

Caller Callers::of(const grpc::CallbackServerContext& context,
                   const google::protobuf::Message& request) const {
  const auto access = access_->settings();
  const auto peer = peer_of(context);
  auto caller = admitted_caller(access.get(), peer, claim_of(context));
  caller.origin = origin_of(access.get(), peer, caller, request, groups_for(access.get()));
  return caller;
}

}  // namespace axisd::server
