#include "api/cell/callers.hpp"

#include <chrono>

#include "api/cell/names.hpp"
#include "api/transport/peer_certificates.hpp"

namespace axisd::cell {
Caller Callers::of(const grpc::ServerContextBase& context) const {
  if (!live_) return {.name = "local", .local = true};
  const auto shown = transport::certificates_of(context);
  if (shown.empty())
    return {.name = "unnamed",
            .refusal = Error{.reason = Reason::unauthenticated,
                             .message = "no certificate was shown",
                             .remedy = "connect with one"}};
  auto client = live_->served()->clients.of(shown, std::chrono::system_clock::now());
  const auto role = role_of(settings_, client.name);
  return {.name = std::move(client.name), .role = role, .refusal = std::move(client.refusal)};
}

bool Callers::is_entrance(const Caller& caller) const {
  return caller.local || caller.name == "cell." + settings_.cell;
}

std::optional<Metadata> Callers::metadata_for(const Caller& caller) {
  if (caller.local) return Metadata();
  if (!is_user_name(caller.name)) return std::nullopt;
  return Metadata{{"axisd-user", caller.name}, {"axisd-role", std::string(to_string(caller.role))}};
}

std::optional<std::string_view> metadata_of(const grpc::ServerContextBase& context, std::string_view key) {
  const auto& all = context.client_metadata();
  const auto found = all.find({key.data(), key.size()});
  if (found == all.end()) return std::nullopt;
  return std::string_view(found->second.data(), found->second.size());
}

}  // namespace axisd::cell
