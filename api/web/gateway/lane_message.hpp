// Messages of the lane (README.md). Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "api/web/gateway/grpc_web.hpp"

namespace axisd::web {

/// Bytes of one message of the page, at most.
inline constexpr std::size_t largest_lane_message = std::size_t{16} * 1024;
/// The WebSocket's subprotocol.
inline constexpr std::string_view lane_protocol = "axisd-lane-1";

/// What a page asks for. Looks into the message's bytes.
struct LaneRequest {
  std::uint32_t id = 0;
  std::uint32_t sent_ms = 0;   ///< by the page's clock
  std::string_view method{};   ///< "axisd.v1.AxisService/Stop"; empty: an echo
  std::string_view message{};  ///< the request, encoded
};

/// Nothing: it is none of this version.
[[nodiscard]] std::optional<LaneRequest> parse_lane_request(std::string_view bytes);

enum class LaneReply : std::uint8_t {
  answer = 1,
  late = 2,  ///< dropped: it came too late to be meant any more
  echo = 3,
  refused = 4,  ///< by the gateway
};

[[nodiscard]] std::string lane_reply(LaneReply kind, std::uint32_t id, const CallStatus& status = {},
                                     std::string_view response = {});

}  // namespace axisd::web
