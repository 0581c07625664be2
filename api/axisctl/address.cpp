#include "api/axisctl/address.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace axisd::axisctl {
namespace {

/// Without brackets and without a port.
bool is_ipv6(std::string_view text) {
  constexpr std::string_view characters = "0123456789abcdefABCDEF:.";
  return std::ranges::count(text, ':') > 1 && text.find_first_not_of(characters) == text.npos;
}

}  // namespace

std::string with_port(const std::string& address, std::uint16_t port) {
  if (is_ipv6(address)) return fmt::format("[{}]:{}", address, port);
  const bool bracketed = address.starts_with('[') && address.ends_with(']');
  if (address.empty() || (!bracketed && address.find_first_of(":/") != std::string::npos)) return address;
  return fmt::format("{}:{}", address, port);
}

}  // namespace axisd::axisctl
