#include "api/web/gateway/connection.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <boost/asio/write.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <utility>

#include "api/grpc_text/grpc_text.hpp"
#include "api/web/gateway/http_rules.hpp"
#include "api/web/gateway/lane_message.hpp"
#include "api/web/gateway/lane_socket.hpp"
#include "api/web/gateway/lane_state.hpp"

namespace axisd::web {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;

namespace {

/// Read ahead while a request is answered.
constexpr std::size_t most_ahead = 4096;
/// How long, and how much, is read of a request that was refused before it was read: else the answer may get
/// lost.
constexpr Duration drained_for = std::chrono::seconds(2);

/// Which machine of several a call is for.
constexpr std::string_view machine_header = "axisd-machine";

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

Connection::Connection(Gateway& gateway, Transport transport, std::string peer, Shares::Place place)
    : gateway_(gateway),
      transport_(std::move(transport)),
      peer_(std::move(peer)),
      place_(std::move(place)),
      since_(gateway.clock.now()) {}

void Connection::start() {
  if (!transport_.encrypted()) return wait_for_request();
  limit(gateway_.settings.limits.request);
  transport_.async_handshake([self = shared_from_this()](Error error) {
    if (self->phase_ == Phase::closed) return;
    if (error) return self->close();
    self->certificate_ = self->transport_.certificate();
    self->wait_for_request();
  });
}

void Connection::close() {
  if (phase_ == Phase::closed) return;
  phase_ = Phase::closed;
  deadline_.reset();
  if (auto call = std::exchange(passing_.call, nullptr)) {
    // A page that has left wanted none the less that it stops.
    if (passing_.stops)
      call->leave([place = std::make_shared<std::optional<Shares::Place>>(std::move(passing_.stream))] {});
    else
      call->cancel();
  }
  passing_.stream.reset();
  acting_ = false;
  transport_.close();
  place_.reset();
}

std::optional<TimePoint> Connection::idle_since() const {
  if (phase_ == Phase::closed || (phase_ == Phase::working && acting_)) return std::nullopt;
  return since_;
}

void Connection::limit(Duration duration) {
  deadline_ = gateway_.clock.call_at(gateway_.clock.now() + duration, [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->close();
  });
}

// Reading.

void Connection::wait_for_request() {
  phase_ = Phase::waiting;
  since_ = gateway_.clock.now();
  const auto& limits = gateway_.settings.limits;
  limit(ever_known_ ? limits.idle : limits.log_in);
  if (watching_) return;  // as it did while the last one was answered
  if (buffer_.size() > 0)
    read_head();
  else
    watch();
}

void Connection::watch() {
  if (std::exchange(watching_, true)) return;
  transport_.async_read_some(
      buffer_.prepare(most_ahead),
      [self = shared_from_this()](Error error, std::size_t size) { self->watched(error, size); });
}

void Connection::watched(Error error, std::size_t size) {
  watching_ = false;
  if (phase_ == Phase::closed) return;
  if (error) return close();  // a call that nobody reads ends with it
  buffer_.commit(size);
  // While it works, what comes is the next request's. Nothing more is read then.
  if (acting_) return close();
  if (phase_ == Phase::waiting) read_head();
  if (phase_ == Phase::ending) drain();
}

void Connection::read_head() {
  phase_ = Phase::reading;
  since_ = gateway_.clock.now();
  limit(gateway_.settings.limits.request);
  parser_.emplace();
  limit_request(*parser_, static_cast<std::uint64_t>(gateway_.settings.limits.body) * 1024);
  keep_alive_ = false;
  http::async_read_header(
      transport_, buffer_, *parser_, [self = shared_from_this()](Error error, std::size_t) {
        if (self->phase_ == Phase::closed) return;
        if (error == http::error::body_limit) return self->refuse(plain(413, "the request is too large"));
        if (error == http::error::header_limit || error == http::error::buffer_overflow)
          return self->refuse(plain(431, "the head is too large"));
        if (error.category() == http::make_error_code(http::error::bad_method).category() &&
            error != http::error::end_of_stream && error != http::error::partial_message)
          return self->refuse(plain(400, "this is no HTTP"));
        if (error) return self->close();
        self->keep_alive_ = self->parser_->get().keep_alive();
        self->handle();
      });
}

void Connection::read_body(std::function<void()> then) {
  http::async_read(transport_, buffer_, *parser_,
                   [self = shared_from_this(), then = std::move(then)](Error error, std::size_t) {
                     if (self->phase_ == Phase::closed) return;
                     if (error == http::error::body_limit)
                       return self->refuse(plain(413, "the request is too large"));
                     if (error) return self->close();
                     self->phase_ = Phase::working;
                     self->since_ = self->gateway_.clock.now();
                     self->deadline_.reset();
                     if (self->buffer_.size() == 0)
                       self->watch();
                     else if (self->acting_)
                       return self->close();
                     then();
                   });
}

std::string_view Connection::header(http::field name) const { return view(parser_->get()[name]); }
std::string_view Connection::header(std::string_view name) const {
  return view(parser_->get()[beast::string_view(name.data(), name.size())]);
}

// What is asked for.

std::optional<Answer> Connection::objection() const {
  const auto& request = parser_->get();
  if (request.version() != 11) return plain(505, "HTTP/1.1 is spoken here");
  // By its name another site's page could be brought to ask here: without TLS no certificate tells this host.
  if (request.count(http::field::host) != 1 ||
      (!transport_.encrypted() && !is_loopback_host(header(http::field::host))))
    return plain(421, "this host has another name");
  return std::nullopt;
}

void Connection::handle() {
  if (const auto objected = objection()) return refuse(*objected);
  const auto target = view(parser_->get().target());
  const auto path = target.substr(0, target.find('?'));
  if (path.starts_with("/axisd.v1.")) return begin_call();
  if (path == "/session") return serve_session();
  if (path == "/sessions" || path.starts_with("/sessions/")) return serve_sessions(path);
  if (path == "/lane") return begin_lane();
  const auto method = parser_->get().method();
  if (method != http::verb::get && method != http::verb::head)
    return refuse(plain(405, "only GET is served here"));
  if (path == "/healthz") return serve_health();
  serve_file(path);
}

bool Connection::same_origin() const {
  return parser_->get().count(http::field::origin) == 1 &&
         is_same_origin(header(http::field::origin), header(http::field::host), transport_.encrypted());
}

bool Connection::identify(bool is_use) {
  auto known = gateway_.who(header(http::field::cookie), certificate_, transport_.encrypted(), is_use);
  if (!known) return false;
  known_ = *std::move(known);
  ever_known_ = true;
  return true;
}

void Connection::serve_file(std::string_view path) {
  const auto* asset = gateway_.assets.find(path);
  if (asset == nullptr)
    return answer(
        plain(404, gateway_.assets.count() == 0 ? "the page is not installed" : "there is no such file"));
  const bool compressed = !asset->gzip.empty() && accepts(header(http::field::accept_encoding), "gzip");
  auto etag = asset->etag;
  if (compressed) etag.insert(etag.size() - 1, "-gz");
  Answer file{.type = asset->type};
  file.headers = {{"Cache-Control", asset->immutable ? "public, max-age=31536000, immutable" : "no-cache"},
                  {"ETag", etag},
                  {"Vary", "Accept-Encoding"}};
  if (header(http::field::if_none_match) == etag) {
    file.status = 304;
    file.type = {};
  } else {
    file.body = compressed ? asset->gzip : asset->content;
    if (compressed) file.headers.emplace_back("Content-Encoding", "gzip");
  }
  answer(file);
}

void Connection::serve_health() {
  const auto trouble = gateway_.trouble();
  answer(trouble.empty() ? plain(200, "ok") : plain(503, trouble));
}

void Connection::begin_lane() {
  const auto& request = parser_->get();
  if (!beast::websocket::is_upgrade(request)) return refuse(plain(426, "this is for a WebSocket"));
  if (!same_origin()) return refuse(plain(403, "another origin"));
  if (!accepts(header(http::field::sec_websocket_protocol), lane_protocol))
    return refuse(plain(400, fmt::format("the subprotocol is {}", lane_protocol)));
  if (!identify(true)) return refuse(plain(401, "nobody is logged in"));
  const auto target = view(request.target());
  constexpr std::string_view query = "/lane?machine=";
  auto* daemon =
      gateway_.machine(target.starts_with(query) ? target.substr(query.size()) : std::string_view());
  if (daemon == nullptr) return refuse(plain(404, "there is no such machine"));
  auto place = gateway_.lanes.take(known_.person.key());
  if (!place) return refuse(plain(429, "there are too many lanes"));
  phase_ = Phase::closed;  // what goes on here is the lane
  deadline_.reset();
  http::request<http::empty_body> head;
  head.base() = request.base();
  std::make_shared<LaneSocket>(gateway_, *daemon, std::move(transport_), known_, *std::move(place),
                               *std::move(place_))
      ->start(std::move(head));
}

// A call.

std::optional<Answer> Connection::objection_to_call() const {
  const auto& request = parser_->get();
  if (request.method() != http::verb::post || !is_call_path(view(request.target())))
    return refused_call(404, {.code = code::unimplemented, .message = "there is no such call"});
  if (!same_origin()) return refused_call(403, {.code = code::unauthenticated, .message = "another origin"});
  if (header(http::field::content_type) != grpc_web_type)
    return refused_call(
        415, {.code = code::invalid_argument, .message = fmt::format("only {} is taken", grpc_web_type)});
  return std::nullopt;
}

void Connection::begin_call() {
  if (const auto objected = objection_to_call()) return refuse(*objected);
  if (!identify(true))
    return refuse(refused_call(401, {.code = code::unauthenticated, .message = "nobody is logged in"}));
  passing_.daemon = gateway_.machine(header(machine_header));
  if (passing_.daemon == nullptr)
    return refuse(refused_call(404, {.code = code::not_found, .message = "there is no such machine"}));
  const auto target = view(parser_->get().target());
  const auto method = method_of_path(target);
  const auto kind = method ? std::optional(kind_of(*method)) : std::nullopt;
  // A call may be held up for long, and a stop that is asked for meanwhile comes before it. Of a jog,
  // whatever service it is asked of, nothing would see that the page is gone.
  if (kind == LaneKind::start || kind == LaneKind::release || target.ends_with("/Jog"))
    return refuse(
        failed_call({.code = code::failed_precondition,
                     .message = fmt::format("{} goes over the lane", target.substr(target.rfind('/') + 1))}));
  passing_.stops = kind == LaneKind::stop;
  passing_.stream = (passing_.stops ? gateway_.stops : gateway_.streams).take(known_.person.key());
  if (!passing_.stream)
    return refuse(refused_call(
        429, {.code = code::resource_exhausted, .message = "too many calls of this person are open"}));
  acting_ = true;
  read_body([this] { start_call(); });
}

void Connection::start_call() {
  const auto message = message_of(parser_->get().body());
  if (!message) {
    passing_.stream.reset();
    acting_ = false;
    return answer(refused_call(400, message.error()));
  }
  head_sent_ = false;
  auto timeout = grpc_text::timeout_of(header("grpc-timeout"));
  if (passing_.stops)
    timeout = std::min<Duration>(timeout.value_or(Duration::max()), LaneState::patience_of_stops);
  passing_.call = passing_.daemon->start(
      std::string(view(parser_->get().target())), *message, known_.person, timeout,
      {.message = [self = shared_from_this()](const grpc::ByteBuffer& part) { self->pass_on(part); },
       .done = [self = shared_from_this()](const CallStatus& status) { self->end_call(status); }});
  parser_->get().body() = {};
}

void Connection::pass_on(const grpc::ByteBuffer& message) {
  std::string bytes;
  if (!std::exchange(head_sent_, true)) bytes = head_of(200, grpc_web_type, std::nullopt, {}, keep_alive_);
  const auto size = message.Length();
  bytes.reserve(bytes.size() + size + 32);
  bytes += fmt::format("{:x}\r\n", frame_head_size + size);
  bytes += message_head(size);
  append(bytes, message);
  bytes += "\r\n";
  // The next one only when this one is on its way: whoever takes them slowly gets the newest.
  write(std::move(bytes), [this] {
    if (passing_.call) passing_.call->next();
  });
}

void Connection::end_call(const CallStatus& status) {
  passing_.call.reset();
  passing_.stream.reset();
  acting_ = false;
  std::string bytes;
  if (!std::exchange(head_sent_, true)) bytes = head_of(200, grpc_web_type, std::nullopt, {}, keep_alive_);
  bytes += chunk(trailers_frame(status));
  bytes += last_chunk;
  write(std::move(bytes), [this] { finish(); });
}

// Writing.

void Connection::answer(const Answer& said) {
  phase_ = Phase::working;
  since_ = gateway_.clock.now();
  // A body that nobody asked for is not read.
  if (!parser_->is_done() && (parser_->chunked() || parser_->content_length().value_or(0) > 0))
    return refuse(said);
  const bool with_body = parser_->get().method() != http::verb::head;
  write(to_bytes(said, keep_alive_, with_body), [this] { finish(); });
}

void Connection::refuse(const Answer& said) {
  phase_ = Phase::working;
  since_ = gateway_.clock.now();
  passing_.stream.reset();
  acting_ = false;
  write(to_bytes(said, false), [this] { end_gently(); });
}

void Connection::write(std::string bytes, std::function<void()> then) {
  if (phase_ == Phase::closed) return;
  out_ = std::move(bytes);
  limit(gateway_.settings.limits.stalled);
  asio::async_write(transport_, asio::buffer(out_),
                    [self = shared_from_this(), then = std::move(then)](Error error, std::size_t) {
                      if (self->phase_ == Phase::closed) return;
                      if (error) return self->close();
                      self->deadline_.reset();
                      then();
                    });
}

void Connection::finish() {
  if (!keep_alive_) return end_gently();
  parser_.reset();
  wait_for_request();
}

void Connection::end_gently() {
  phase_ = Phase::ending;
  since_ = gateway_.clock.now();
  limit(drained_for);
  transport_.end();
  drain();
}

void Connection::drain() {
  if (watching_) return;  // its end closes it
  buffer_.clear();
  watching_ = true;
  transport_.async_read_some(buffer_.prepare(most_ahead),
                             [self = shared_from_this()](Error error, std::size_t) {
                               self->watching_ = false;
                               if (self->phase_ != Phase::ending) return;
                               if (error) return self->close();
                               self->drain();
                             });
}

}  // namespace axisd::web
