#include "api/web/gateway/grpc_web.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "api/grpc_text/grpc_text.hpp"
#include "api/web/gateway/big_endian.hpp"

namespace axisd::web {
namespace {

constexpr std::string_view package = "/axisd.v1.";
constexpr char compressed = 1;
constexpr char trailers = static_cast<char>(0x80);

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= 64 && std::ranges::all_of(text, [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
  });
}

std::unexpected<CallStatus> wrong(int why, std::string message) {
  return std::unexpected(CallStatus{.code = why, .message = std::move(message)});
}

}  // namespace

bool is_call_path(std::string_view path) {
  if (!path.starts_with(package)) return false;
  path.remove_prefix(package.size());
  const auto slash = path.find('/');
  return slash != std::string_view::npos && is_name(path.substr(0, slash)) && is_name(path.substr(slash + 1));
}

std::expected<std::string_view, CallStatus> message_of(std::string_view body) {
  if (body.size() < frame_head_size) return wrong(code::invalid_argument, "the body is no whole frame");
  if (body.front() == compressed) return wrong(code::unimplemented, "messages are not compressed here");
  if (body.front() != 0) return wrong(code::invalid_argument, "the body does not begin with a message");
  const auto size = big_endian32(body.substr(1));
  body.remove_prefix(frame_head_size);
  if (body.size() < size) return wrong(code::invalid_argument, "the body is no whole frame");
  if (body.size() > size) return wrong(code::invalid_argument, "a call takes one message");
  return body;
}

std::string message_head(std::size_t size) {
  std::string head(1, '\0');
  append_big_endian32(head, static_cast<std::uint32_t>(size));
  return head;
}

std::string trailers_frame(const CallStatus& status) {
  auto text = fmt::format("grpc-status: {}\r\n", status.code);
  if (!status.message.empty())
    text += fmt::format("grpc-message: {}\r\n", grpc_text::percent_encoded(status.message));
  if (!status.details.empty()) text += fmt::format("grpc-status-details-bin: {}\r\n", base64(status.details));
  auto frame = message_head(text.size());
  frame.front() = trailers;
  return frame + text;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto group = bytes.substr(i, 3);
    std::uint32_t bits = 0;
    for (std::size_t j = 0; j < 3; ++j)
      bits = bits << 8U | (j < group.size() ? static_cast<unsigned char>(group[j]) : 0U);
    for (std::size_t j = 0; j < 4; ++j)
      text += j <= group.size() ? digits[bits >> (18 - 6 * j) & 0x3FU] : '=';
  }
  return text;
}

}  // namespace axisd::web
