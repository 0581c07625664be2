#include "api/web/gateway/http_answer.hpp"

#include <fmt/format.h>

#include "api/grpc_text/grpc_text.hpp"

namespace axisd::web {
namespace {

std::string_view reason_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 304:
      return "Not Modified";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 413:
      return "Content Too Large";
    case 415:
      return "Unsupported Media Type";
    case 421:
      return "Misdirected Request";
    case 426:
      return "Upgrade Required";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "Error";
  }
}

constexpr std::string_view always =
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n";

bool has(const std::vector<Header>& headers, std::string_view name) {
  for (const auto& header : headers)
    if (header.first == name) return true;
  return false;
}

}  // namespace

std::string head_of(int status, std::string_view type, std::optional<std::size_t> length,
                    const std::vector<Header>& headers, bool keep_alive) {
  auto head = fmt::format("HTTP/1.1 {} {}\r\n", status, reason_of(status));
  if (!type.empty()) head += fmt::format("Content-Type: {}\r\n", type);
  if (!length)
    head += "Transfer-Encoding: chunked\r\n";
  else if (status != 204 && status != 304)
    head += fmt::format("Content-Length: {}\r\n", *length);
  head += always;
  if (!has(headers, "Cache-Control")) head += "Cache-Control: no-store\r\n";
  for (const auto& [name, value] : headers) head += fmt::format("{}: {}\r\n", name, value);
  if (!keep_alive) head += "Connection: close\r\n";
  return head + "\r\n";
}

std::string to_bytes(const Answer& answer, bool keep_alive, bool with_body) {
  auto bytes = head_of(answer.status, answer.type, answer.body.size(), answer.headers, keep_alive);
  if (with_body) bytes += answer.body;
  return bytes;
}

Answer plain(int status, std::string text) {
  return {.status = status, .type = "text/plain; charset=utf-8", .body = std::move(text) + '\n'};
}

Answer json(int status, std::string body) {
  return {.status = status, .type = "application/json", .body = std::move(body)};
}

Answer refused_call(int status, const CallStatus& why) {
  auto answer = plain(status, why.message);
  answer.headers.emplace_back("grpc-status", std::to_string(why.code));
  answer.headers.emplace_back("grpc-message", grpc_text::percent_encoded(why.message));
  return answer;
}

Answer failed_call(const CallStatus& why) {
  return {.status = 200, .type = grpc_web_type, .body = trailers_frame(why)};
}

std::string chunk(std::string_view bytes) { return fmt::format("{:x}\r\n{}\r\n", bytes.size(), bytes); }

}  // namespace axisd::web
