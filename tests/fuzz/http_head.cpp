// A request as anybody may send it to axisd-web, in pieces of any size: what is read of it, and what is asked
// of its head before anything is done for it.
#include "api/grpc_text/grpc_text.hpp"
#include "api/web/gateway/grpc_web.hpp"
#include "api/web/gateway/http_rules.hpp"
#include "api/web/gateway/lane_message.hpp"
#include "api/web/gateway/lane_state.hpp"
#include "api/web/gateway/request_parser.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

namespace http = boost::beast::http;
constexpr std::uint64_t most_body = 2048;

std::string_view view(boost::beast::string_view from) { return {from.data(), from.size()}; }

/// False: nothing more is read.
bool read(web::RequestParser& parser, std::string& buffer) {
  boost::system::error_code error;
  while (!parser.is_done() && !buffer.empty()) {
    const auto taken = parser.put(boost::asio::buffer(buffer), error);
    expect(taken <= buffer.size(), "nothing is read that did not come");
    buffer.erase(0, taken);
    if (error == http::error::need_more) return true;
    if (error) return false;
    if (parser.is_header_done() && !parser.eager()) break;
    if (taken == 0) break;
  }
  return true;
}

void look_at(const web::RequestParser& parser) {
  const auto& request = parser.get();
  const auto target = view(request.target());
  const auto of = [&](http::field name) { return view(request[name]); };
  if (web::is_call_path(target)) expect(target.find_first_of(" \r\n%.?") == 6, "a path is a path");
  (void)web::method_of_path(target);
  (void)web::is_loopback_host(of(http::field::host));
  (void)web::is_same_origin(of(http::field::origin), of(http::field::host), false);
  if (const auto cookie = web::cookie_of(of(http::field::cookie), "axisd"))
    expect(cookie->find(';') == std::string_view::npos, "a cookie ends");
  (void)web::accepts(of(http::field::sec_websocket_protocol), web::lane_protocol);
  (void)grpc_text::timeout_of(view(request["grpc-timeout"]));
}

}  // namespace

void run(Input input) {
  web::RequestParser parser;
  web::limit_request(parser, most_body);
  std::string buffer;
  bool looked_at = false;
  while (!input.empty()) {
    const std::size_t size = input.byte();
    buffer += text(input.take(size == 255 ? 2048 : size));
    if (!read(parser, buffer)) return;
    if (!parser.is_header_done()) continue;
    if (!std::exchange(looked_at, true)) {
      look_at(parser);
      parser.eager(true);
      if (!read(parser, buffer)) return;
    }
    expect(parser.get().body().size() <= most_body, "a body is bounded");
    if (parser.is_done()) break;
  }
  if (!parser.is_done()) return;
  if (const auto message = web::message_of(parser.get().body()))
    expect(message->size() + web::frame_head_size == parser.get().body().size(),
           "one frame is the whole body");
}

}  // namespace axisd::fuzz
