// Parts of requests as anybody may send them to axisd-web.
#include "api/grpc_text/grpc_text.hpp"
#include "api/web/gateway/grpc_web.hpp"
#include "api/web/gateway/http_answer.hpp"
#include "api/web/gateway/http_rules.hpp"
#include "api/web/gateway/lane_message.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  using namespace web;
  const auto kind = input.byte();
  const auto some = text(input.take(input.byte()));
  const auto rest = text(input.rest());
  if (const auto message = message_of(rest))
    expect(message->size() + frame_head_size == rest.size(), "one frame is the whole body");
  if (const auto request = parse_lane_request(rest))
    expect(request->method.size() + request->message.size() + 10 == rest.size(), "nothing is lost");
  const auto timeout = grpc_text::timeout_of(some);
  expect(!timeout || *timeout >= Duration::zero(), "time does not go back");
  if (const auto cookie = cookie_of(rest, "axisd"))
    expect(cookie->find(';') == std::string_view::npos, "a cookie ends");
  const CallStatus status{.code = kind, .message = std::string(some), .details = std::string(rest)};
  const auto trailers = trailers_frame(status);
  expect(grpc_text::percent_encoded(some).find_first_of("\r\n") == std::string::npos, "no line is forged");
  expect(trailers.size() > frame_head_size, "there are trailers");
  const auto quoted = json_text(some);
  expect(quoted.find_first_of("\r\n") == std::string::npos, "no line is forged in JSON");
  if (is_call_path(rest)) expect(rest.find_first_of(" \r\n%.?") == 6, "a path is a path");
  (void)is_same_origin(some, rest, (kind & 1U) != 0);
  (void)is_loopback_host(rest);
  (void)accepts(rest, "gzip");
  (void)lane_reply(LaneReply::answer, kind, status, some);
}

}  // namespace axisd::fuzz
