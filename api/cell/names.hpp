// Names that come from elsewhere: what may stand in a table, a log line, a key of etcd. Pure.
#pragma once

#include <cstddef>
#include <string_view>

namespace axisd::cell {

inline constexpr std::size_t longest_name = 64;

/// As axisd takes it: a letter, then letters, digits, - or _; lower case; at most 64 characters.
[[nodiscard]] bool is_machine_name(std::string_view name);
/// What an axisd takes as `axisd-user`: 1 to 64 printable ASCII characters without spaces.
[[nodiscard]] bool is_user_name(std::string_view name);
/// "HOST:PORT" of printable ASCII, with a port from 1 to 65535; also "unix:/PATH".
[[nodiscard]] bool is_address(std::string_view address);
/// Of a path of gRPC, "/axisd.v1.AxisService/Stop": the call stops something, and needs no role.
[[nodiscard]] bool is_stop(std::string_view path);
/// What axisd never counts: stops, and what keeps or ends a hold or a lease.
[[nodiscard]] bool is_never_counted(std::string_view path);
/// It is for the stop lane of an axisd.
[[nodiscard]] bool is_for_lane(std::string_view path);

}  // namespace axisd::cell
