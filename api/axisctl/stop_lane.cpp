#include "api/axisctl/stop_lane.hpp"

#include <fmt/format.h>

#include <charconv>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {

std::string stop_lane_of(const std::string& server) {
  if (server.starts_with("unix:")) return server + ".stop";
  const auto colon = server.rfind(':');
  if (colon == std::string::npos) return {};
  unsigned port = 0;
  const auto* end = server.data() + server.size();
  if (const auto read = std::from_chars(server.data() + colon + 1, end, port);
      read.ec != std::errc{} || read.ptr != end || port == 0 || port >= 65535)
    return {};
  return fmt::format("{}:{}", server.substr(0, colon), port + 1);
}

bool is_reachable(grpc::Channel& lane, std::chrono::milliseconds patience) {
  const auto until = std::chrono::system_clock::now() + patience;
  for (;;) {
    const auto state = lane.GetState(true);
    if (state == GRPC_CHANNEL_READY) return true;
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE || state == GRPC_CHANNEL_SHUTDOWN) return false;
    if (!lane.WaitForStateChange(state, until)) return false;
  }
}

bool is_for_the_main_address(const grpc::Status& status, bool repeatable) {
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED) return true;
  if (!repeatable) return false;
  const auto detail = detail_of(status);
  return !detail || detail->reason() == v1::REASON_UNKNOWN_AXIS;  // of another machine's lane, perhaps
}

}  // namespace axisd::axisctl
