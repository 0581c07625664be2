#include "api/axisctl/tls_trouble.hpp"

#include <fmt/format.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>

#include "api/tls/client_check.hpp"

namespace axisd::axisctl {
namespace {

std::string contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::optional<Error> trouble(const Connection& connection, const std::string& server) {
  const tls::ClientFiles files{.ca = contents(connection.tls_ca),
                               .certificate = contents(connection.tls_certificate),
                               .key = contents(connection.tls_key)};
  const auto now = std::chrono::system_clock::now();
  if (auto own = tls::wrong_with(files, now)) return own;
  const auto colon = server.rfind(':');
  if (server.starts_with("unix:") || colon == std::string::npos) return std::nullopt;
  auto host = server.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  const auto shown = tls::look_at(host, server.substr(colon + 1), std::chrono::seconds(1));
  return shown ? tls::why_refused(files, *shown, host, now) : std::nullopt;
}

}  // namespace

Failure with_tls_trouble(const Failure& failure, const Connection& connection) {
  if (failure.code() != ExitCode::unreachable || failure.detail()) return failure;
  const auto server = connection.address();
  const auto why = trouble(connection, server);
  if (!why) return failure;
  // What may have been done is said as well: there was a connection then.
  if (!failure.nothing_sent())
    return failure.saying(fmt::format("{}; {}; {}", failure.what(), why->message, why->remedy));
  return failure.saying(fmt::format("cannot reach {} at {}: {}; {}",
                                    connection.through_entrance() ? "axisd-cell" : "axisd", server,
                                    why->message, why->remedy));
}

}  // namespace axisd::axisctl
