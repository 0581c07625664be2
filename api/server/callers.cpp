#include "api/server/callers.hpp"

#include <fmt/format.h>
#include <grpc/grpc_security_constants.h>

#include <utility>
#include <vector>

#include "api/server/local_peer.hpp"
#include "api/server/peer.hpp"
#include "buses/limited_log.hpp"

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

Callers::Callers(Machine& machine, std::shared_ptr<const AccessControl> access)
    : machine_(machine), access_(access ? std::move(access) : std::make_shared<const AccessControl>()) {}

void Callers::enter(int connection) {
  auto peer = local_peer(connection);
  const std::lock_guard lock(mutex_);
  local_.insert_or_assign(name_of(connection), std::move(peer));
}

Peer Callers::peer_of(const grpc::CallbackServerContext& context) const {
  const auto auth = context.auth_context();
  if (auth && auth->IsPeerAuthenticated()) {
    const auto pem = auth->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
    return {.name = identities_->of(pem.empty() ? std::string()
                                                : std::string(pem.front().data(), pem.front().size()))};
  }
  const auto connection = context.peer();
  if (connection.starts_with(given)) {
    const std::lock_guard lock(mutex_);
    if (const auto found = local_.find(connection); found != local_.end()) return found->second;
  }
  return {.name = "local:" + peer_host(connection)};
}

Result<void> Callers::admit(const grpc::CallbackServerContext& context,
                            const google::protobuf::Message& request) const {
  const auto access = access_->settings();
  const auto claim = claim_of(context);
  if (!access && !claim.user && !claim.role) return {};
  const auto peer = peer_of(context);
  const auto groups = access ? machine_.group_access().groups() : std::vector<GroupSettings>();
  const auto caller = admitted(access.get(), peer, claim, request, groups);
  if (caller) return {};
  log_limited(spdlog::level::info, peer.name, "refused calls",
              fmt::format("{} refused: {}", request.GetDescriptor()->name(), to_string(caller.error())));
  return fail(caller.error());
}

Caller Callers::of(const grpc::CallbackServerContext& context) const {
  const auto access = access_->settings();
  return admitted_caller(access.get(), peer_of(context), claim_of(context));
}

}  // namespace axisd::server
