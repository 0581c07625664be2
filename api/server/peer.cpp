#include "api/server/peer.hpp"

#include <fmt/format.h>
#include <grpc/grpc_security_constants.h>

#include <algorithm>
#include <string_view>

#include "devices/axis/known_ids.hpp"

namespace axisd::server {
namespace {

constexpr std::size_t longest_identity = 128;

}  // namespace

std::string printable_identity(std::string_view name) {
  std::string result(name.substr(0, longest_identity));
  std::ranges::replace_if(result, [](char c) { return c < ' ' || c > '~'; }, '?');
  return result;
}

std::string unnamed_identity(std::string_view pem) { return fmt::format("unnamed:{:016x}", hash_of(pem)); }

std::string client_of(const grpc::CallbackServerContext& context) {
  const auto auth = context.auth_context();
  if (auth && auth->IsPeerAuthenticated()) {
    for (const auto* property : {GRPC_X509_CN_PROPERTY_NAME, GRPC_X509_SAN_PROPERTY_NAME}) {
      const auto values = auth->FindPropertyValues(property);
      if (!values.empty() && !values.front().empty())
        return printable_identity({values.front().data(), values.front().size()});
    }
    const auto whole = auth->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
    return unnamed_identity(whole.empty() ? ""
                                          : std::string_view(whole.front().data(), whole.front().size()));
  }
  return "local:" + peer_host(context.peer());
}

std::optional<Duration> patience_of(const grpc::CallbackServerContext& context) {
  const auto deadline = context.raw_deadline();
  if (gpr_time_cmp(deadline, gpr_inf_future(deadline.clock_type)) == 0) return std::nullopt;
  const auto left = gpr_time_sub(deadline, gpr_now(deadline.clock_type));
  constexpr std::int64_t day = 24L * 3600;
  return std::chrono::seconds(std::clamp<std::int64_t>(left.tv_sec, -day, day)) +
         std::chrono::nanoseconds(left.tv_nsec);
}

std::string peer_host(const std::string& peer) {
  const std::string_view text = peer;
  const auto scheme = text.find(':');
  if (scheme == std::string_view::npos || !text.starts_with("ip")) return std::string(text.substr(0, scheme));
  const auto port = text.rfind(':');
  auto host =
      std::string(text.substr(scheme + 1, port > scheme ? port - scheme - 1 : std::string_view::npos));
  for (const std::string_view bracket : {"%5B", "%5D", "[", "]"})
    if (const auto at = host.find(bracket); at != std::string::npos) host.erase(at, bracket.size());
  // "localhost" is any of these, one this time and another the next: a repeated request has to be its own.
  const bool loopback = host == "::1" || host.starts_with("127.") || host.starts_with("::ffff:127.");
  return loopback ? "localhost" : host;
}

}  // namespace axisd::server
