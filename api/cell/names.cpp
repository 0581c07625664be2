#include "api/cell/names.hpp"

#include <algorithm>
#include <array>

#include "api/transport/address.hpp"

namespace axisd::cell {
namespace {

constexpr std::size_t longest_address = 255;

bool printable(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c > ' ' && c <= '~'; });
}

}  // namespace

bool is_machine_name(std::string_view name) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return !name.empty() && name.size() <= longest_name && letter(name.front()) &&
         std::ranges::all_of(
             name, [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '-' || c == '_'; });
}

bool is_user_name(std::string_view name) {
  return !name.empty() && name.size() <= longest_name && printable(name);
}

bool is_address(std::string_view address) {
  if (address.size() > longest_address || !printable(address)) return false;
  if (address.starts_with("unix:")) return address.size() > 6 && address[5] == '/';
  const auto found = transport::host_and_port(address);
  return found && found->port != "0";
}

bool is_for_lane(std::string_view path) { return path.starts_with("/axisd.v1.StopService/"); }

bool is_stop(std::string_view path) {
  constexpr std::array<std::string_view, 6> names{"Stop",      "Halt",      "QuickStop",
                                                  "GroupStop", "GroupHalt", "StopAll"};
  constexpr std::array<std::string_view, 4> services{"/axisd.v1.AxisService/", "/axisd.v1.GroupService/",
                                                     "/axisd.v1.SystemService/", "/axisd.v1.StopService/"};
  return std::ranges::any_of(services, [&](std::string_view service) {
    return path.starts_with(service) && std::ranges::find(names, path.substr(service.size())) != names.end();
  });
}

bool is_never_counted(std::string_view path) {
  constexpr std::array<std::string_view, 7> others{
      "/axisd.v1.AxisService/Disable",           "/axisd.v1.AxisService/ReleaseStop",
      "/axisd.v1.GroupService/GroupReleaseStop", "/axisd.v1.GroupService/RenewPrepared",
      "/axisd.v1.LeaseService/RenewLease",       "/axisd.v1.LeaseService/ReleaseLease",
      "/axisd.v1.CommandService/CancelCommand"};
  return is_stop(path) || is_for_lane(path) || std::ranges::find(others, path) != others.end();
}

}  // namespace axisd::cell
