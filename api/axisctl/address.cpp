#include "api/axisctl/address.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

/// Without brackets and without a port.
bool is_ipv6(std::string_view text) {
  constexpr std::string_view characters = "0123456789abcdefABCDEF:.";
  return std::ranges::count(text, ':') > 1 && text.find_first_not_of(characters) == text.npos;
}

/// gRPC takes the rest of a number that is too large, and 443 where there is none.
bool is_port(std::string_view text) {
  std::uint16_t port = 0;
  const auto [behind, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc{} && behind == text.data() + text.size() && port != 0;
}

/// Of gRPC's own addresses, "dns:press-1".
bool is_scheme(std::string_view text) {
  constexpr std::string_view known[] = {"dns", "ipv4", "ipv6", "unix-abstract", "vsock"};
  return std::ranges::find(known, text) != std::end(known);
}

}  // namespace

std::string with_port(const std::string& address, std::uint16_t port) {
  if (is_ipv6(address)) return fmt::format("[{}]:{}", address, port);
  const bool bracketed = address.starts_with('[') && address.ends_with(']');
  if (address.empty() || address.starts_with("unix:")) return address;
  if (!bracketed && address.find('/') != std::string::npos) return address;
  const auto colon = bracketed ? std::string::npos : address.rfind(':');
  if (colon == std::string::npos) return fmt::format("{}:{}", address, port);
  const auto behind = std::string_view(address).substr(colon + 1);
  if (!is_port(behind) && !is_scheme(std::string_view(address).substr(0, colon)))
    throw Failure(ExitCode::usage, fmt::format("'{}': a port is a number from 1 to 65535", address));
  return address;
}

}  // namespace axisd::axisctl
