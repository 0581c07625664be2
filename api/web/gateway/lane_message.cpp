#include "api/web/gateway/lane_message.hpp"

#include <algorithm>
#include <limits>

#include "api/web/gateway/big_endian.hpp"

namespace axisd::web {
namespace {

constexpr char version = 1;
constexpr std::size_t head_size = 10;

}  // namespace

std::optional<LaneRequest> parse_lane_request(std::string_view bytes) {
  if (bytes.size() < head_size || bytes.size() > largest_lane_message || bytes.front() != version)
    return std::nullopt;
  const auto length = static_cast<unsigned char>(bytes[head_size - 1]);
  if (bytes.size() - head_size < length) return std::nullopt;
  return LaneRequest{.id = big_endian32(bytes.substr(1)),
                     .sent_ms = big_endian32(bytes.substr(5)),
                     .method = bytes.substr(head_size, length),
                     .message = bytes.substr(head_size + length)};
}

std::string lane_reply(LaneReply kind, std::uint32_t id, const CallStatus& status,
                       std::string_view response) {
  std::string bytes(1, static_cast<char>(kind));
  append_big_endian32(bytes, id);
  bytes += static_cast<char>(status.code);
  const auto message = std::string_view(status.message).substr(0, std::numeric_limits<std::uint16_t>::max());
  append_big_endian16(bytes, static_cast<std::uint16_t>(message.size()));
  bytes += message;
  append_big_endian32(bytes, static_cast<std::uint32_t>(status.details.size()));
  bytes += status.details;
  bytes += response;
  return bytes;
}

}  // namespace axisd::web
