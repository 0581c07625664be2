// gRPC-Web: frames in a body of HTTP/1.1, as a browser can send and read them. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <string>
#include <string_view>

namespace axisd::web {

/// How a call ended, as gRPC says it.
struct CallStatus {
  int code = 0;  ///< of gRPC; 0: OK
  std::string message{};
  std::string details{};  ///< google.rpc.Status, encoded; may be empty
  bool not_sent = false;  ///< the gateway refused it: nothing has left here
};

/// Codes of gRPC that the gateway uses itself.
namespace code {
inline constexpr int cancelled = 1, unknown = 2, invalid_argument = 3, deadline_exceeded = 4, not_found = 5,
                     permission_denied = 7, resource_exhausted = 8, failed_precondition = 9,
                     unimplemented = 12, internal = 13, unavailable = 14, data_loss = 15,
                     unauthenticated = 16;
}  // namespace code

inline constexpr std::string_view grpc_web_type = "application/grpc-web+proto";
inline constexpr std::size_t frame_head_size = 5;

/// Whether a path is that of a call which is passed on: "/axisd.v1.AxisService/Stop".
[[nodiscard]] bool is_call_path(std::string_view path);
/// The message of a request's body: exactly one frame, uncompressed. Errors: invalid_argument, unimplemented.
[[nodiscard]] std::expected<std::string_view, CallStatus> message_of(std::string_view body);
/// What comes before a message of that many bytes.
[[nodiscard]] std::string message_head(std::size_t size);
/// The last frame of an answer.
[[nodiscard]] std::string trailers_frame(const CallStatus& status);

/// With padding.
[[nodiscard]] std::string base64(std::string_view bytes);

}  // namespace axisd::web
