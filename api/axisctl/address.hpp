// The address of a daemon as people write it. Pure.
#pragma once

#include <cstdint>
#include <string>

namespace axisd::axisctl {

/// Of the daemon; its stop lane has the one after it, unless the configuration says otherwise.
inline constexpr std::uint16_t usual_port = 7443, usual_stop_port = 7444;
/// Of the entrance of a cell.
inline constexpr std::uint16_t usual_cell_port = 7445;

/// With a port: "press-1" is "press-1:7443", "::1" is "[::1]:7443". What has a port, "unix:PATH" and other
/// names of gRPC's stay as they are. Throws Failure: the port is none.
[[nodiscard]] std::string with_port(const std::string& address, std::uint16_t port);

}  // namespace axisd::axisctl
